// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdmt/nn/learning_rate_schedule.h"
#include "sdmt/reid/model_file.h"
#include "sdmt/train/augmentation.h"
#include "sdmt/train/batch_hard_loss.h"
#include "sdmt/train/pk_sampler.h"
#include "sdmt/train/teacher_loss.h"
#include "sdmt/train/tied_head.h"
#include "sdmt/train/training_set.h"

namespace sdmt::train {

enum class OptimizerKind { adam, sgd };

struct TrainerOptions {
  std::int64_t iterations = 3000;  ///< optimiser steps, >= 1 (the paper: 90,000)
  std::uint64_t seed = 0;          ///< of everything random
  BatchHardOptions loss;
  int identities = 32;                 ///< P of PkSamplerOptions
  int instances = 4;                   ///< K of PkSamplerOptions
  std::vector<double> source_weights;  ///< see PkSamplerOptions

  /// With TrainingSet::teacher, its loss is added to that of the people's identities, times a
  /// weight > 0.
  TeacherMatch teacher_match = TeacherMatch::projection;
  double teacher_weight = 1.0;
  /// Images without identities in a batch beside the P x K, >= 0; none when the set has none.
  int unlabelled_batch = 32;

  /// First layer that is trained, all before it stay as they are: a layer of the trunk ("conv3_1":
  /// the last block of vgg16), or the first of the head ("fc1": the head only). Empty: the whole
  /// network.
  std::string first_trained;
  std::optional<BlockGrid> tie = BlockGrid{};  ///< absent: the paper's FC1 with all its weights
  AugmentationOptions augmentation;
  /// Ways to look at each image, computed once through the frozen layers and then drawn from: as it
  /// is, mirrored, and views - 2 augmented ones. 0: every image is augmented anew each time and
  /// goes through all layers; the only choice when no layer is frozen. >= 0.
  int views = 6;

  OptimizerKind optimizer = OptimizerKind::adam;
  double learning_rate = 1e-3;  ///< of the head, > 0
  double trunk_lr_scale = 0.1;  ///< the trunk's learning rate is this times the head's, > 0
  double momentum = 0.9;        ///< sgd only, in [0,1)
  double weight_decay = 0.0;    ///< >= 0
  double clip_norm = std::numeric_limits<double>::infinity();  ///< of the whole gradient, > 0
  nn::LearningRateDecay decay = nn::LearningRateDecay::cosine;
  double decay_start = 0.0;             ///< fraction of the iterations, in [0,1]
  double final_factor = 0.02;           ///< last learning rate / plateau, in (0,1]
  std::int64_t warmup_iterations = 20;  ///< >= 0
  /// Exponential moving average of the weights and running statistics, validated and saved in their
  /// place: what a step keeps of it, in [0, 1) (0.999 suits some 10,000 iterations). 0: none.
  double average = 0.0;
  std::int64_t validate_every = 100;  ///< iterations, >= 1; also after the last

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

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
/// training was interrupted or not.
class Trainer {
 public:
  /// `model` gives the start and takes the result; it must outlive the trainer.
  /// Throws std::invalid_argument as the options do, and for an unknown layer.
  Trainer(reid::Model& model, TrainingSet data, TrainerOptions options);
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
  /// Nothing to validate on: an empty result, and the last weights count as the best.
  Validation validate();

  /// Writes everything that determines the steps to come, whole or not at all. The file is also a
  /// model file with the present weights (the average is beside them). Throws as io::OutputFile.
  void save_checkpoint(const std::filesystem::path& path);
  /// Goes on where a checkpoint was written. Throws std::invalid_argument naming the setting when
  /// it belongs to another configuration, or the tensor when it is damaged.
  void load_checkpoint(const std::filesystem::path& path);

  /// Puts the best weights into the model, FC1 expanded, and describes the training in its
  /// metadata.
  void finish();

 private:
  struct Run;
  std::unique_ptr<Run> run_;
};

}  // namespace sdmt::train
