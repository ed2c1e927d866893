// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/trainer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "checkpoint.h"
#include "feature_cache.h"
#include "patches.h"
#include "principal_axes.h"
#include "random_stream.h"
#include "sdmt/nn/adam.h"
#include "sdmt/nn/clip_grad_norm.h"
#include "sdmt/nn/sgd.h"
#include "sdmt/reid/validation_auc.h"
#include "sdmt/train/configuration.h"
#include "sdmt/train/pk_sampler.h"
#include "sdmt/train/trainer_option_table.h"
#include "trained_network.h"
#include "training_configuration.h"
#include "unlabelled_sampler.h"
#include "weight_average.h"

namespace sdmt::train {

namespace {

PkSamplerOptions sampler_options(const TrainerOptions& options) {
  return {options.identities, options.instances, options.source_weights, options.seed};
}

nn::LearningRateSchedule make_schedule(const TrainerOptions& options) {
  return nn::LearningRateSchedule({options.learning_rate, options.iterations,
                                   options.warmup_iterations, options.decay, options.decay_start,
                                   options.final_factor});
}

std::unique_ptr<nn::Optimizer> make_optimizer(const TrainerOptions& options,
                                              std::vector<nn::NamedParameter> parameters) {
  if (options.optimizer == OptimizerKind::sgd) {
    return std::make_unique<nn::Sgd>(
        std::move(parameters),
        nn::SgdOptions{options.learning_rate, options.momentum, options.weight_decay});
  }
  nn::AdamOptions adam;
  adam.learning_rate = options.learning_rate;
  adam.weight_decay = options.weight_decay;
  return std::make_unique<nn::Adam>(std::move(parameters), adam);
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

// The layer that an empty first_trained stands for gets its name.
TrainerOptions complete(TrainerOptions options, const reid::EmbeddingNetwork& network) {
  if (options.first_trained.empty()) options.first_trained = network.description().layers[0].name;
  return options;
}

}  // namespace

void TrainerOptions::validate() const {
  trainer_option_table().validate(*this);
  sampler_options(*this).validate();
}

struct Trainer::Run {
  reid::Model& model;
  TrainingSet data;
  TrainerOptions options;
  TrainedNetwork network;
  PkSampler sampler;
  UnlabelledSampler unlabelled_sampler;
  Projection teacher;  // [images] or empty
  nn::LearningRateSchedule schedule;
  std::unique_ptr<nn::Optimizer> optimizer;
  Configuration front;
  CollapseMonitor monitor;

  std::optional<FeatureCache> cache;  // of the training images
  std::vector<FeatureCache> validation_caches;

  std::int64_t iteration = 0;
  std::int64_t best_iteration = 0;
  std::vector<double> best_scores;  // by validation set
  std::vector<nn::Tensor> best;     // as network.state()
  std::optional<WeightAverage> average;

  nn::Tensor patches, features, gradient, taught;

  Run(reid::Model& start, TrainingSet training_set, TrainerOptions training_options)
      : model(start),
        data(std::move(training_set)),
        options(complete(std::move(training_options), model.network)),
        network(model.network, options.tie, options.first_trained,
                static_cast<float>(options.trunk_lr_scale)),
        sampler(data.identities, static_cast<int>(data.sources.size()), sampler_options(options)),
        unlabelled_sampler(data.unlabelled, data.unlabelled.empty() ? 0 : options.unlabelled_batch,
                           options.seed),
        schedule(make_schedule(options)),
        optimizer(make_optimizer(options, network.parameters())),
        front(front_configuration(options, data, network)),
        best_scores(data.validation.size(), 0.0) {
    if (!network.has_front()) options.views = 0;
    if (options.average > 0) average.emplace(options.average).start(network.state());
    if (options.teacher_match == TeacherMatch::projection && !data.teacher.empty()) {
      const nn::Shape map = model.network.trunk().output_shape(model.network.input_shape(1));
      teacher = project(data.teacher, model.network.head().output_shape(map).c);
    } else {
      teacher.rows = data.teacher;
    }
    keep_as_best();
  }

  // Puts the averaged weights, if there are any, into the network, or takes them out again.
  void swap_average() {
    if (!average) return;
    average->swap(network.state());
    network.parameters_changed();
  }

  // Loss of the teacher for the images of a batch; adds to `gradient`.
  double learn_from_teacher(const nn::Tensor& embeddings, const std::vector<int>& images) {
    nn::Shape shape = teacher.rows.shape();
    shape.n = static_cast<int>(images.size());
    taught.resize(shape);
    for (int i = 0; i < shape.n; ++i) {
      const float* row = teacher.rows.image(images[i]);
      std::copy_n(row, shape.c, taught.image(i));
    }
    return teacher_loss<float>(embeddings.values(), taught.values(), shape.n, options.teacher_match,
                               options.teacher_weight, gradient.values());
  }

  FeatureCache::Source training_source() const {
    return {data.images, options.views, options.augmentation, options.seed,
            model.metadata.preprocessing};
  }

  void keep_as_best() {
    best_iteration = iteration;
    best.clear();
    for (const auto& [name, tensor] : network.state()) best.push_back(*tensor);
  }

  // The input of the trained layers for one batch.
  void fill_features(const std::vector<int>& images) {
    if (!cache) {
      make_batch_patches(data.images, images, iteration, options.augmentation, options.seed,
                         model.metadata.preprocessing, patches);
      features = network.run_front(patches);
      return;
    }
    features.resize(network.front_shape(static_cast<int>(images.size())));
    auto random = random_stream(options.seed, Purpose::augmentation, 0,
                                static_cast<std::uint64_t>(iteration));
    std::vector<View> views;
    for (const int image : images) {
      const auto view = random.below(static_cast<std::uint64_t>(options.views));
      views.push_back({image, static_cast<int>(view)});
    }
#pragma omp parallel for schedule(static)
    for (int i = 0; i < static_cast<int>(views.size()); ++i) {
      cache->read(views[i], features.image(i));
    }
  }

  // Embeddings of a validation set, as a tracker would compute them.
  nn::Tensor embed(std::size_t set) {
    constexpr int kBatch = 64;
    const auto& images = data.validation[set].images;
    const int count = static_cast<int>(images.size());
    nn::Tensor embeddings({count, 1, 1, model.network.embedding_size()});
    for (int first = 0; first < count; first += kBatch) {
      const int size = std::min(kBatch, count - first);
      if (network.has_front()) {
        features.resize(network.front_shape(size));
        for (int i = 0; i < size; ++i) {
          validation_caches[set].read({first + i, 0}, features.image(i));
        }
      } else {
        std::vector<View> views;
        views.reserve(static_cast<std::size_t>(size));
        for (int i = 0; i < size; ++i) views.push_back({first + i, 0});
        make_view_patches(images, views, options.augmentation, options.seed,
                          model.metadata.preprocessing, features);
      }
      const nn::Tensor& rows = network.forward(features, nn::Mode::inference);
      std::copy_n(rows.data(), rows.size(), embeddings.image(first));
    }
    return embeddings;
  }

  Checkpoint checkpoint() {
    Checkpoint result{iteration, best_iteration, best_scores, {}};
    const auto state = network.state();
    for (std::size_t i = 0; i < state.size(); ++i) {
      result.tensors.push_back({"state." + state[i].name, state[i].tensor});
      result.tensors.push_back({"best." + state[i].name, &best[i]});
      if (average) result.tensors.push_back({"average." + state[i].name, &average->values()[i]});
    }
    for (auto& [name, tensor] : optimizer->state()) {
      result.tensors.push_back({"optimizer." + name, tensor});
    }
    return result;
  }
};

Trainer::Trainer(reid::Model& model, TrainingSet data, TrainerOptions options) {
  options.validate();
  run_ = std::make_unique<Run>(model, std::move(data), std::move(options));
}

Trainer::~Trainer() = default;

const TrainingSet& Trainer::data() const { return run_->data; }
double Trainer::teacher_kept() const { return run_->teacher.kept; }

std::size_t Trainer::cache_bytes() const {
  return run_->options.views == 0 ? 0 : FeatureCache::bytes(run_->network, run_->training_source());
}

void Trainer::prepare(const Progress& progress, const std::filesystem::path& cache_file) {
  if (!run_->network.has_front()) return;
  const bool stored = !cache_file.empty() && std::filesystem::exists(cache_file);
  std::int64_t total =
      stored ? 0 : static_cast<std::int64_t>(run_->data.images.size()) * run_->options.views;
  for (const auto& set : run_->data.validation) {
    total += static_cast<std::int64_t>(set.images.size());
  }
  std::int64_t before = 0;
  const CacheProgress report = [&](std::int64_t done, std::int64_t) {
    if (progress) progress(before + done, total);
  };
  for (const auto& set : run_->data.validation) {
    FeatureCache::Source source = run_->training_source();
    source.images = set.images;
    source.views = 1;
    run_->validation_caches.emplace_back(run_->network, source, report);
    before += static_cast<std::int64_t>(set.images.size());
  }
  if (run_->options.views == 0) return;
  run_->cache.emplace(run_->network, run_->training_source(), report, cache_file, run_->front);
}

std::int64_t Trainer::iteration() const { return run_->iteration; }
bool Trainer::finished() const { return run_->iteration >= run_->options.iterations; }

TrainingStep Trainer::step() {
  Run& run = *run_;
  const PkSampler::Batch batch = run.sampler.batch(run.iteration);
  std::vector<int> images = batch.images;  // and then those without identities
  const auto unlabelled = run.unlabelled_sampler.batch(run.iteration);
  images.insert(images.end(), unlabelled.begin(), unlabelled.end());
  run.fill_features(images);
  const nn::Tensor& embeddings = run.network.forward(run.features, nn::Mode::training);
  run.gradient.resize(embeddings.shape());
  run.gradient.fill(0.0F);
  const std::size_t labelled = batch.images.size() * embeddings.shape().image_size();
  const BatchHardResult result =
      batch_hard_loss<float>(embeddings.values().first(labelled), batch.labels, batch.images,
                             run.options.loss, run.gradient.values().first(labelled));
  TrainingStep report;
  if (!run.teacher.rows.empty()) report.teacher_loss = run.learn_from_teacher(embeddings, images);
  if (!std::isfinite(result.loss + report.teacher_loss.value_or(0))) {
    throw std::runtime_error("the loss is not finite at iteration " +
                             std::to_string(run.iteration + 1) + ": lower the learning rate");
  }
  run.optimizer->zero_grad();
  run.network.backward(run.gradient);

  report.gradient_norm = nn::clip_grad_norm(run.network.parameters(), run.options.clip_norm);
  report.learning_rate = run.schedule.at(run.iteration);
  run.optimizer->set_learning_rate(report.learning_rate);
  run.optimizer->step();
  run.network.parameters_changed();
  report.iteration = ++run.iteration;
  if (run.average) run.average->add(run.network.state(), run.iteration);
  report.loss = result.loss;
  report.mining = result.mining;
  report.warning = run.monitor.add(result.mining);
  return report;
}

bool Trainer::validation_due() const {
  return finished() || run_->iteration % run_->options.validate_every == 0;
}

Validation Trainer::validate() {
  Run& run = *run_;
  Validation result;
  std::vector<double> scores;
  run.swap_average();
  for (std::size_t set = 0; set < run.data.validation.size(); ++set) {
    scores.push_back(reid::validation_auc(run.embed(set), run.data.validation[set].labels));
    result.auc.emplace_back(run.data.validation[set].name, scores.back());
  }
  result.mean_auc = mean(scores);
  result.best = scores.empty() || result.mean_auc > mean(run.best_scores);
  if (result.best) {
    run.best_scores = scores;
    run.keep_as_best();
  }
  run.swap_average();
  return result;
}

void Trainer::save_checkpoint(const std::filesystem::path& path) {
  run_->network.store();
  write_checkpoint(path, run_->model,
                   training_configuration(run_->options, run_->data, run_->front),
                   run_->checkpoint());
}

void Trainer::load_checkpoint(const std::filesystem::path& path) {
  Checkpoint checkpoint = run_->checkpoint();
  read_checkpoint(path, training_configuration(run_->options, run_->data, run_->front),
                  run_->options.iterations, checkpoint);
  run_->iteration = checkpoint.iteration;
  run_->best_iteration = checkpoint.best_iteration;
  run_->best_scores = checkpoint.best_scores;
  run_->network.parameters_changed();
}

void Trainer::finish() {
  Run& run = *run_;
  const auto state = run.network.state();
  for (std::size_t i = 0; i < state.size(); ++i) *state[i].tensor = run.best[i];
  run.network.parameters_changed();
  run.network.store();

  reid::TrainingSummary summary;
  summary.datasets = run.data.sources;
  summary.iterations = run.best_iteration;
  summary.loss = run.options.loss.kind == LossKind::contrastive ? "batch-hard contrastive"
                                                                : "batch-hard triplet, soft margin";
  if (!run.teacher.rows.empty()) summary.loss += ", teacher";
  for (std::size_t set = 0; set < run.best_scores.size(); ++set) {
    summary.scores[run.data.validation[set].name + " auc"] = run.best_scores[set];
  }
  run.model.metadata.training = std::move(summary);
  run.model.metadata.margin = run.options.loss.margin;
  run.model.metadata.tau_a.reset();  // held for the old weights
}

}  // namespace sdmt::train
