// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <span>
#include <stdexcept>

#include "best_weights.h"
#include "frozen_features.h"
#include "pending_sums.h"
#include "random_stream.h"
#include "sdmt/reid/validation_auc.h"
#include "sdmt/train/pair_classifier.h"
#include "trained_network.h"
#include "training_parts.h"

namespace sdmt::train {

namespace {

// All rows of a batch, of which those of `here` are here.
void gather_rows(const nn::Tensor& here, const nn::BatchShards& shards, nn::Tensor& all) {
  all.resize({shards.images(), 1, 1, here.shape().c});
  std::ranges::copy(here.values(), all.image(shards.begin(shards.first())));
  shards.gather_images(all.values(), here.shape().image_size());
}

// Process 0 computes it.
double auc_of(PairClassifier& classifier, const nn::Tensor& blocks, const std::vector<int>& labels,
              nn::ProcessGroup& group) {
  double auc = 0;
  if (group.rank() == 0) {
    auc = reid::validation_auc(
        classifier.forward_features(blocks, nn::Mode::inference), labels,
        [&](const float* a, const float* b) { return classifier.distance(a, b); });
  }
  group.broadcast(std::as_writable_bytes(std::span(&auc, 1)));
  return auc;
}

}  // namespace

PairClassifier train_pair_classifier(reid::Model& model, TrainingSet data, TrainerOptions options,
                                     const PairTrainingEvents& events,
                                     const std::filesystem::path& cache_file,
                                     nn::ProcessGroup& group) {
  options.first_trained = model.network.head().name(0);  // the frozen front of a head-only training
  options.validate();
  if (options.views < 1 || options.tie != BlockGrid{}) {
    throw std::invalid_argument(
        "the pair classifier is trained on cached views of 8x2 blocks: expected views >= 1 and "
        "tie 8x2");
  }
  // The trunk, then the means over the blocks.
  TrainedNetwork front(model.network, options.tie, options.first_trained, 1.0F);
  FrozenFeatures blocks_of(front, data, options, model.metadata.preprocessing, group);
  blocks_of.prepare(events.caching, cache_file);
  std::vector<nn::Tensor> validation(data.validation.size());
  for (std::size_t set = 0; set < validation.size(); ++set) {
    const int images = static_cast<int>(data.validation[set].images.size());
    blocks_of.of_validation(set, 0, images, validation[set]);
  }

  PairClassifier classifier(model.network.trunk().output_shape(model.network.input_shape(1)));
  classifier.initialize(options.seed);
  const auto optimizer = make_optimizer(options, classifier.parameters());
  const nn::LearningRateSchedule schedule = make_schedule(options);
  PkSampler sampler(data.identities, static_cast<int>(data.sources.size()),
                    sampler_options(options));

  const nn::BatchShards shards(options.identities * options.instances, group);
  BestWeights best;
  best.scores.assign(validation.size(), 0.0);
  best.keep(classifier.state(), 0);
  nn::Tensor blocks, features, scores, d_scores;
  for (std::int64_t iteration = 0; iteration < options.iterations; ++iteration) {
    const auto batch = sampler.batch(iteration);
    auto random =
        random_stream(options.seed, Purpose::view, 0, static_cast<std::uint64_t>(iteration));
    blocks_of.of_cached_views(batch.images, random, shards, blocks);
    const LabelledPairs pairs = draw_pairs(batch.labels, batch.images, random);
    const nn::BatchShards pair_shards(static_cast<int>(pairs.pairs.size()), group);
    classifier.set_shards(&shards, &pair_shards);
    gather_rows(classifier.forward_features(blocks, nn::Mode::training), shards, features);
    gather_rows(classifier.forward_pairs(features, pairs.pairs, nn::Mode::training), pair_shards,
                scores);
    PairTrainingStep step;
    step.iteration = iteration + 1;
    step.loss = softmax_cross_entropy(scores, pairs.same, d_scores);
    require_finite_loss(step.loss, step.iteration);
    optimizer->zero_grad();
    {
      PendingSums sums(group);
      const int first = pair_shards.begin(pair_shards.first());
      classifier.backward(d_scores.images(first, pair_shards.images_here()));
      sums.wait();
    }
    optimizer->set_learning_rate(schedule.at(iteration));
    optimizer->step();
    classifier.parameters_changed();

    if (step.iteration % options.validate_every == 0 || step.iteration == options.iterations) {
      std::vector<double> areas;
      for (std::size_t set = 0; set < validation.size(); ++set) {
        areas.push_back(auc_of(classifier, validation[set], data.validation[set].labels, group));
        step.auc.emplace_back(data.validation[set].name, areas.back());
      }
      step.best = best.offer(classifier.state(), step.iteration, areas);
    }
    events.step(step);
  }
  best.restore(classifier.state());
  classifier.parameters_changed();
  classifier.set_shards(nullptr, nullptr);
  return classifier;
}

}  // namespace sdmt::train
