// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sdmt/nn/process_group.h"
#include "sdmt/reid/model_file.h"
#include "sdmt/train/batch_hard_loss.h"
#include "sdmt/train/trainer_options.h"
#include "sdmt/train/training_set.h"

namespace sdmt::train {

/// One optimiser step.
struct TrainingStep {
  std::int64_t iteration = 0;          ///< counted from 1
  double loss = 0;                     ///< of the identities
  std::optional<double> teacher_loss;  ///< of the teacher, before its weight; absent: no teacher
  MiningStatistics mining;
  double learning_rate = 0;
  double gradient_norm = 0;  ///< before clipping
  std::string warning;       ///< see CollapseMonitor; mostly empty
};

/// Areas under the ROC curve over all pairs of each validation set.
struct Validation {
  std::vector<std::pair<std::string, double>> auc;  ///< by set
  double mean_auc = 0;
  bool best = false;  ///< the best so far: its weights are kept
};

/// Trains an embedding network by batch-hard metric learning (section III-A of the paper).
/// The same data, options and seed give the same weights on any number of threads, whether the
/// training was interrupted or not, and however many processes share it: those of a group make the
/// same calls in the same order, each computes its shards of every batch, and all have the same
/// weights.
class Trainer {
 public:
  /// `model` gives the start and takes the result; it and the group must outlive the trainer.
  /// Throws std::invalid_argument as the options do, for an unknown layer, and when the batch has
  /// fewer images than nn::kShards for several processes.
  Trainer(reid::Model& model, TrainingSet data, TrainerOptions options,
          nn::ProcessGroup& group = nn::ProcessGroup::alone());
  ~Trainer();
  Trainer(const Trainer&) = delete;
  Trainer& operator=(const Trainer&) = delete;

  const TrainingSet& data() const;
  /// Share of the teacher's vectors (of their squared lengths) that is left after their projection
  /// to the dimensions of the network, 0..1; 1 where nothing is projected.
  double teacher_kept() const;

  using Progress = std::function<void(std::int64_t done, std::int64_t total)>;

  /// Bytes that the cached results of the frozen layers take (in memory or in the file).
  std::size_t cache_bytes() const;
  /// Computes what the frozen layers make of every view of every image. To be called before the
  /// first step. With `cache_file`, the results are kept in that file and taken from it when it
  /// exists, so that another run over the same data, views and frozen weights begins at once;
  /// throws std::invalid_argument when the file was made with others. `progress` may throw to stop;
  /// nothing is left behind then.
  void prepare(const Progress& progress, const std::filesystem::path& cache_file = {});

  std::int64_t iteration() const;  ///< steps done
  bool finished() const;
  TrainingStep step();

  /// True after iterations at which validate() is due.
  bool validation_due() const;
  /// Embeds the validation sets and keeps the weights when their mean AUC is the best so far.
  /// Nothing to validate on: an empty result, and the last weights count as the best. Throws
  /// std::runtime_error when the weights of two processes of a group differ.
  Validation validate();

  /// Writes everything that determines the steps to come, whole or not at all. The file is also a
  /// model file with the present weights (the average is beside them). Throws as io::OutputFile.
  /// Process 0 of a group writes, the others may leave out the call.
  void save_checkpoint(const std::filesystem::path& path);
  /// Goes on where a checkpoint was written, by however many processes; process 0 of a group reads.
  /// Throws std::invalid_argument naming the setting when it belongs to another configuration, or
  /// the tensor when it is damaged.
  void load_checkpoint(const std::filesystem::path& path);

  /// Puts the best weights into the model, FC1 expanded, and describes the training in its
  /// metadata.
  void finish();

 private:
  struct Run;
  std::unique_ptr<Run> run_;
};

}  // namespace sdmt::train
