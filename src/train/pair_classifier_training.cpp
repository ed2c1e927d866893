// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "feature_cache.h"
#include "patches.h"
#include "random_stream.h"
#include "sdmt/nn/adam.h"
#include "sdmt/nn/learning_rate_schedule.h"
#include "sdmt/reid/validation_auc.h"
#include "sdmt/train/pair_classifier.h"
#include "sdmt/train/pk_sampler.h"
#include "trained_network.h"
#include "training_configuration.h"

namespace sdmt::train {

namespace {

// Blocks of one view of every image, n x [rows, columns, c].
nn::Tensor all_blocks(const FeatureCache& cache, nn::Shape shape, int images) {
  shape.n = images;
  nn::Tensor blocks(shape);
  for (int i = 0; i < images; ++i) cache.read({i, 0}, blocks.image(i));
  return blocks;
}

double auc_of(PairClassifier& classifier, const nn::Tensor& blocks,
              const std::vector<int>& labels) {
  return reid::validation_auc(
      classifier.forward_features(blocks, nn::Mode::inference), labels,
      [&](const float* a, const float* b) { return classifier.distance(a, b); });
}

}  // namespace

PairClassifier train_pair_classifier(reid::Model& model, const TrainingSet& data,
                                     TrainerOptions options, const PairTrainingEvents& events,
                                     const std::filesystem::path& cache_file) {
  options.first_trained = model.network.head().name(0);  // the frozen front of a head-only training
  options.validate();
  if (options.views < 1 || options.tie != BlockGrid{}) {
    throw std::invalid_argument(
        "the pair classifier is trained on cached views of 8x2 blocks: expected views >= 1 and "
        "tie 8x2");
  }
  // The trunk, then the means over the blocks.
  TrainedNetwork front(model.network, options.tie, options.first_trained, 1.0F);
  const FeatureCache cache(front,
                           {data.images, options.views, options.augmentation, options.seed,
                            model.metadata.preprocessing},
                           events.caching, cache_file, front_configuration(options, data, front));
  std::vector<nn::Tensor> validation;
  for (const auto& set : data.validation) {
    const FeatureCache images(
        front, {set.images, 1, options.augmentation, options.seed, model.metadata.preprocessing},
        events.caching);
    validation.push_back(
        all_blocks(images, front.front_shape(1), static_cast<int>(set.images.size())));
  }

  PairClassifier classifier(model.network.trunk().output_shape(model.network.input_shape(1)));
  classifier.initialize(options.seed);
  nn::AdamOptions adam;
  adam.learning_rate = options.learning_rate;
  adam.weight_decay = options.weight_decay;
  nn::Adam optimizer(classifier.parameters(), adam);
  const nn::LearningRateSchedule schedule({options.learning_rate, options.iterations,
                                           options.warmup_iterations, options.decay,
                                           options.decay_start, options.final_factor});
  PkSampler sampler(data.identities, static_cast<int>(data.sources.size()),
                    {options.identities, options.instances, options.source_weights, options.seed});

  std::vector<nn::Tensor> best;
  double best_auc = -1;
  nn::Tensor blocks;
  nn::Tensor d_scores;
  for (std::int64_t iteration = 0; iteration < options.iterations; ++iteration) {
    const auto batch = sampler.batch(iteration);
    auto random =
        random_stream(options.seed, Purpose::view, 0, static_cast<std::uint64_t>(iteration));
    blocks.resize(front.front_shape(static_cast<int>(batch.images.size())));
    for (std::size_t i = 0; i < batch.images.size(); ++i) {
      const auto view = random.below(static_cast<std::uint64_t>(options.views));
      cache.read({batch.images[i], static_cast<int>(view)}, blocks.image(static_cast<int>(i)));
    }
    const LabelledPairs pairs = draw_pairs(batch.labels, batch.images, random);
    const nn::Tensor& features = classifier.forward_features(blocks, nn::Mode::training);
    const nn::Tensor& scores = classifier.forward_pairs(features, pairs.pairs, nn::Mode::training);
    PairTrainingStep step;
    step.iteration = iteration + 1;
    step.loss = softmax_cross_entropy(scores, pairs.same, d_scores);
    if (!std::isfinite(step.loss)) {
      throw std::runtime_error("the loss is not finite at iteration " +
                               std::to_string(step.iteration) + ": lower the learning rate");
    }
    optimizer.zero_grad();
    classifier.backward(d_scores);
    optimizer.set_learning_rate(schedule.at(iteration));
    optimizer.step();
    classifier.parameters_changed();

    if (step.iteration % options.validate_every == 0 || step.iteration == options.iterations) {
      double sum = 0;
      for (std::size_t set = 0; set < validation.size(); ++set) {
        const double auc = auc_of(classifier, validation[set], data.validation[set].labels);
        step.auc.emplace_back(data.validation[set].name, auc);
        sum += auc;
      }
      step.best = validation.empty() || sum > best_auc;
      if (step.best) {
        best_auc = sum;
        best.clear();
        for (const auto& [name, tensor] : classifier.state()) best.push_back(*tensor);
      }
    }
    events.step(step);
  }
  const auto state = classifier.state();
  for (std::size_t i = 0; i < best.size(); ++i) *state[i].tensor = best[i];
  classifier.parameters_changed();
  return classifier;
}

}  // namespace sdmt::train
