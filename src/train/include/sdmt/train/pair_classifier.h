// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "sdmt/nn/linear.h"
#include "sdmt/nn/sequential.h"
#include "sdmt/reid/model_file.h"
#include "sdmt/train/tied_head.h"
#include "sdmt/train/trainer_options.h"
#include "sdmt/train/training_set.h"

namespace sdmt::train {

/// Two rows of one batch of features.
struct FeaturePair {
  int first = 0;
  int second = 0;
};

/// The paper's other Siamese network (its figure of architectures, b): two images in, a learnt
/// softmax classifier says whether they show the same person. A baseline for the learnt metric, on
/// the same frozen trunk: the means over blocks of conv3_3 -> FC to 128, ReLU, BatchNorm, the same
/// weights for both images -> |a - b| and a * b side by side, which do not depend on the order of
/// the two -> FC to 64, ReLU, FC to 2, softmax. Unlike embeddings, its verdicts cannot be computed
/// once an image: every pair costs 16,512 multiplications.
class PairClassifier {
 public:
  static constexpr int kFeatures = 128;
  static constexpr int kHidden = 64;

  /// The blocks of the map are those of BlockGrid's defaults, 8 x 2. For a trunk whose result for
  /// one image is `map`; weights are 0 until initialized or loaded. Throws std::invalid_argument
  /// when the blocks do not fill the map.
  explicit PairClassifier(const nn::Shape& map);

  /// He initialisation; the same seed gives the same weights.
  void initialize(std::uint64_t seed);

  /// Maps of the trunk [n, h, w, c] -> [n, 1, 1, 128]. Valid until the next call.
  const nn::Tensor& features_of_maps(const nn::Tensor& maps);

  /// 1 - P(same person), 0 to 1, from two rows of features. May be called by several threads.
  float distance(const float* a, const float* b) const;

  // For the training. Of which batches of images and pairs the training passes to come are a part:
  // see nn::Layer::set_shards(). Must outlive the passes.
  void set_shards(const nn::BatchShards* images, const nn::BatchShards* pairs);
  // Blocks are the means of the map's blocks [n, rows, columns, c].
  const nn::Tensor& forward_features(const nn::Tensor& blocks, nn::Mode mode);
  /// The two scores (different, same) of each pair that is here: [pairs, 1, 1, 2]. `features`, of
  /// all images of the batch, must live until backward(), `pairs` are all of the batch.
  const nn::Tensor& forward_pairs(const nn::Tensor& features, std::span<const FeaturePair> pairs,
                                  nn::Mode mode);
  /// Given the derivative by these scores, adds to all gradients; after both forwards in training
  /// mode.
  void backward(const nn::Tensor& d_scores);
  std::vector<nn::NamedParameter> parameters();
  /// Parameters and running statistics: what a file holds, under "pair." and these names.
  std::vector<nn::NamedTensor> state();
  void parameters_changed();

 private:
  nn::Sequential blocks_;      // the means
  nn::Sequential tower_;       // "fc1", "relu1", "bn"
  nn::Sequential classifier_;  // "fc2", "relu2", "fc3"
  nn::Linear* fc2_ = nullptr;  // in classifier_
  nn::Linear* fc3_ = nullptr;
  nn::Tensor combined_, d_combined_, d_combined_here_, d_features_;
  const nn::BatchShards* image_shards_ = nullptr;
  const nn::BatchShards* pair_shards_ = nullptr;
  const nn::Tensor* features_ = nullptr;  // of the last forward_pairs()
  std::vector<FeaturePair> pairs_;
};

/// Mean cross entropy of two-way scores [n,1,1,2] and its derivative; same[i] is the right answer.
double softmax_cross_entropy(const nn::Tensor& scores, const std::vector<bool>& same,
                             nn::Tensor& d_scores);

/// As many pairs of one person as of two, drawn from a P x K batch: each image with a random other
/// one of its person and a random one of another person. Images without a partner have no positive.
struct LabelledPairs {
  std::vector<FeaturePair> pairs;
  std::vector<bool> same;
};
LabelledPairs draw_pairs(std::span<const int> labels, std::span<const int> images,
                         nn::Random& random);

/// What the training tells as it goes.
struct PairTrainingStep {
  std::int64_t iteration = 0;  ///< from 1
  double loss = 0;
  std::vector<std::pair<std::string, double>> auc;  ///< by validation set, where it is due
  bool best = false;
};
struct PairTrainingEvents {
  // Both may throw to stop.
  std::function<void(std::int64_t done, std::int64_t total)> caching;
  std::function<void(const PairTrainingStep&)> step;
};

/// Trains a classifier on the frozen trunk of `model`, with the batches, views, optimiser and
/// learning rate of `options` (loss, clip_norm and first_trained do not apply; tie is 8x2).
/// Returns the weights of the best mean validation AUC, or the last without validation. The same
/// for any number of threads and processes. `cache_file` is that of Trainer::prepare(): one made
/// for a training of the head serves here as well.
PairClassifier train_pair_classifier(reid::Model& model, TrainingSet data, TrainerOptions options,
                                     const PairTrainingEvents& events,
                                     const std::filesystem::path& cache_file = {},
                                     nn::ProcessGroup& group = nn::ProcessGroup::alone());

/// A model file that also holds the classifier.
void save_pair_classifier(const std::filesystem::path& path, const reid::Model& model,
                          PairClassifier& classifier, reid::Storage storage);
/// Throws std::invalid_argument naming file and tensor when the file holds none.
PairClassifier load_pair_classifier(const std::filesystem::path& path, reid::Model& model);

}  // namespace sdmt::train
