// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/trainer.h"

#include <algorithm>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "best_weights.h"
#include "checkpoint.h"
#include "frozen_features.h"
#include "pending_sums.h"
#include "principal_axes.h"
#include "sdmt/nn/batch_shards.h"
#include "sdmt/nn/clip_grad_norm.h"
#include "sdmt/reid/validation_auc.h"
#include "shared_blocks.h"
#include "trained_network.h"
#include "training_configuration.h"
#include "training_parts.h"
#include "unlabelled_sampler.h"
#include "weight_average.h"

namespace sdmt::train {

namespace {

// The layer that an empty first_trained stands for gets its name.
TrainerOptions complete(TrainerOptions options, const reid::EmbeddingNetwork& network) {
  if (options.first_trained.empty()) options.first_trained = network.description().layers[0].name;
  return options;
}

}  // namespace

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
  nn::BatchShards shards;
  FrozenFeatures frozen;
  CollapseMonitor monitor;

  std::int64_t iteration = 0;
  BestWeights best;
  std::optional<WeightAverage> average;

  nn::Tensor features, embeddings, gradient, taught;

  Run(reid::Model& start, TrainingSet training_set, TrainerOptions training_options,
      nn::ProcessGroup& group)
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
        shards(batch_size(), group),
        frozen(network, data, options, model.metadata.preprocessing, group) {
    network.set_shards(&shards);
    best.scores.assign(data.validation.size(), 0.0);
    if (options.average > 0) average.emplace(options.average).start(network.state());
    if (options.teacher_match != TeacherMatch::relations && !data.teacher.empty()) {
      const nn::Shape map = model.network.trunk().output_shape(model.network.input_shape(1));
      teacher = project(data.teacher, model.network.head().output_shape(map).c);
    } else {
      teacher.rows = data.teacher;
    }
    best.keep(network.state(), iteration);
  }

  int batch_size() const {
    return options.identities * options.instances +
           (data.unlabelled.empty() ? 0 : options.unlabelled_batch);
  }

  nn::ProcessGroup& group() const { return shards.group(); }

  // Embeddings of a whole batch.
  void embed_batch(const std::vector<int>& images) {
    frozen.of_batch(images, iteration, shards, features);
    const nn::Tensor& here = network.forward(features, nn::Mode::training);
    embeddings.resize({shards.images(), 1, 1, here.shape().c});
    std::ranges::copy(here.values(), embeddings.image(shards.begin(shards.first())));
    shards.gather_images(embeddings.values(), here.shape().image_size());
  }

  // From the gradient of a whole batch.
  void backward() {
    optimizer->zero_grad();
    PendingSums sums(group());
    network.backward(gradient.images(shards.begin(shards.first()), shards.images_here()));
    sums.wait();
  }

  // What should be the same everywhere: if it is not, hardware or a library is to blame.
  void require_agreement() {
    std::vector<std::uint64_t> prints(static_cast<std::size_t>(group().size()));
    if (prints.size() == 1) return;
    std::vector<std::size_t> bounds;
    for (std::size_t rank = 0; rank <= prints.size(); ++rank) {
      bounds.push_back(rank * sizeof(std::uint64_t));
    }
    prints[group().rank()] = network.state_fingerprint();
    group().gather(std::as_writable_bytes(std::span(prints)), bounds);
    for (std::size_t rank = 1; rank < prints.size(); ++rank) {
      if (prints[rank] == prints[0]) continue;
      throw std::runtime_error("the weights of process " + std::to_string(rank) +
                               " are not those of process 0 after iteration " +
                               std::to_string(iteration) +
                               ": its machine does not compute the same");
    }
  }

  // Puts the averaged weights, if there are any, into the network, or takes them out again.
  void swap_average() {
    if (!average) return;
    average->swap(network.state());
    network.parameters_changed();
  }

  // Loss of the teacher for the images of a batch; adds to `gradient`.
  double learn_from_teacher(const std::vector<int>& images) {
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

  // Embeddings of a validation set, as a tracker would compute them.
  nn::Tensor embed(std::size_t set) {
    const int count = static_cast<int>(data.validation[set].images.size());
    const int size = model.network.embedding_size();
    nn::Tensor result({count, 1, 1, size});
    for_shared_blocks(
        count, group(),
        [&](std::int64_t begin, std::int64_t end) {
          if (begin == end) return;
          const int first = static_cast<int>(begin);
          frozen.of_validation(set, first, static_cast<int>(end) - first, features);
          const nn::Tensor& rows = network.forward(features, nn::Mode::inference);
          std::copy_n(rows.data(), rows.size(), result.image(first));
        },
        [&](const std::vector<std::int64_t>& bounds) {
          const auto first = static_cast<int>(bounds.front());
          nn::Tensor round = result.images(first, static_cast<int>(bounds.back()) - first);
          group().gather(std::as_writable_bytes(round.values()),
                         byte_bounds(bounds, size * sizeof(float)));
        });
    return result;
  }

  Checkpoint checkpoint() {
    Checkpoint result{iteration, best.iteration, best.scores, {}};
    const auto state = network.state();
    for (std::size_t i = 0; i < state.size(); ++i) {
      result.tensors.push_back({"state." + state[i].name, state[i].tensor});
      result.tensors.push_back({"best." + state[i].name, &best.values[i]});
      if (average) result.tensors.push_back({"average." + state[i].name, &average->values()[i]});
    }
    for (auto& [name, tensor] : optimizer->state()) {
      result.tensors.push_back({"optimizer." + name, tensor});
    }
    return result;
  }
};

Trainer::Trainer(reid::Model& model, TrainingSet data, TrainerOptions options,
                 nn::ProcessGroup& group) {
  options.validate();
  run_ = std::make_unique<Run>(model, std::move(data), std::move(options), group);
}

Trainer::~Trainer() = default;

const TrainingSet& Trainer::data() const { return run_->data; }
double Trainer::teacher_kept() const { return run_->teacher.kept; }

std::size_t Trainer::cache_bytes() const { return run_->frozen.cache_bytes(); }

void Trainer::prepare(const Progress& progress, const std::filesystem::path& cache_file) {
  run_->frozen.prepare(progress, cache_file);
}

std::int64_t Trainer::iteration() const { return run_->iteration; }
bool Trainer::finished() const { return run_->iteration >= run_->options.iterations; }

TrainingStep Trainer::step() {
  Run& run = *run_;
  const PkSampler::Batch batch = run.sampler.batch(run.iteration);
  std::vector<int> images = batch.images;  // and then those without identities
  const auto unlabelled = run.unlabelled_sampler.batch(run.iteration);
  images.insert(images.end(), unlabelled.begin(), unlabelled.end());
  run.embed_batch(images);
  const nn::Tensor& embeddings = run.embeddings;
  run.gradient.resize(embeddings.shape());
  run.gradient.fill(0.0F);
  const std::size_t labelled = batch.images.size() * embeddings.shape().image_size();
  const BatchHardResult result =
      batch_hard_loss<float>(embeddings.values().first(labelled), batch.labels, batch.images,
                             run.options.loss, run.gradient.values().first(labelled));
  TrainingStep report;
  if (!run.teacher.rows.empty()) report.teacher_loss = run.learn_from_teacher(images);
  require_finite_loss(result.loss + report.teacher_loss.value_or(0), run.iteration + 1);
  run.backward();

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
  run.require_agreement();
  run.swap_average();
  for (std::size_t set = 0; set < run.data.validation.size(); ++set) {
    const nn::Tensor embeddings = run.embed(set);
    double auc = 0;
    if (run.group().rank() == 0) {
      auc = reid::validation_auc(embeddings, run.data.validation[set].labels);
    }
    run.group().broadcast(std::as_writable_bytes(std::span(&auc, 1)));
    scores.push_back(auc);
    result.auc.emplace_back(run.data.validation[set].name, scores.back());
  }
  result.mean_auc = mean_score(scores);
  result.best = run.best.offer(run.network.state(), run.iteration, scores);
  run.swap_average();
  return result;
}

void Trainer::save_checkpoint(const std::filesystem::path& path) {
  if (run_->group().rank() > 0) return;
  run_->network.store();
  write_checkpoint(path, run_->model,
                   training_configuration(run_->options, run_->data, run_->frozen.configuration()),
                   run_->checkpoint());
}

void Trainer::load_checkpoint(const std::filesystem::path& path) {
  Checkpoint checkpoint = run_->checkpoint();
  if (run_->group().rank() == 0) {
    read_checkpoint(path,
                    training_configuration(run_->options, run_->data, run_->frozen.configuration()),
                    run_->options.iterations, checkpoint);
  }
  broadcast_checkpoint(run_->group(), checkpoint);
  run_->iteration = checkpoint.iteration;
  run_->best.iteration = checkpoint.best_iteration;
  run_->best.scores = checkpoint.best_scores;
  run_->network.parameters_changed();
}

void Trainer::finish() {
  Run& run = *run_;
  run.best.restore(run.network.state());
  run.network.parameters_changed();
  run.network.store();

  reid::TrainingSummary summary;
  summary.datasets = run.data.sources;
  summary.iterations = run.best.iteration;
  summary.loss = run.options.loss.kind == LossKind::contrastive ? "batch-hard contrastive"
                                                                : "batch-hard triplet, soft margin";
  if (!run.teacher.rows.empty()) summary.loss += ", teacher";
  for (std::size_t set = 0; set < run.best.scores.size(); ++set) {
    summary.scores[run.data.validation[set].name + " auc"] = run.best.scores[set];
  }
  run.model.metadata.training = std::move(summary);
  run.model.metadata.margin = run.options.loss.margin;
  run.model.metadata.tau_a.reset();  // held for the old weights
  run.model.metadata.adaptation.reset();
}

}  // namespace sdmt::train
