// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/adaptation.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "best_weights.h"
#include "patches.h"
#include "random_stream.h"
#include "scene_anchors.h"
#include "scene_batches.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/train/batch_hard_loss.h"
#include "sdmt/train/teacher_loss.h"
#include "trained_network.h"
#include "training_parts.h"

namespace sdmt::train {

namespace {

// Crops through the network at once where nothing is learnt.
constexpr int kAtOnce = 64;
// A triplet's softness, in units of the distance that separates one person from two.
constexpr double kTripletScale = 9;
// Weights are good as long as this share of the most that was gained is left: on few people a curve
// trembles by as much, while what the anchor allows to be learnt goes on to help.
constexpr double kKeptGain = 0.5;
// Multiplications of a crop from which on only the head is trained.
constexpr double kLargeNetwork = 0.5e9;

AugmentationOptions views_of_the_scene() {
  AugmentationOptions options;
  options.brightness = 0.2;
  options.contrast = 0.1;
  options.tint = 0.04;
  return options;
}

void require_evidence(const SceneCrops& crops, const std::string& part) {
  const auto refuse = [&part](const std::string& what, std::size_t count, std::size_t least) {
    throw std::invalid_argument(part + " has " + std::to_string(count) + " " + what +
                                ", expected at least " + std::to_string(least) +
                                ": more people, or more time, are needed to learn from");
  };
  std::size_t in_company = 0;
  for (int a = 0; a < crops.met.tracks(); ++a) {
    for (int b = 0; b < crops.met.tracks(); ++b) {
      if (!crops.met(a, b)) continue;
      ++in_company;
      break;
    }
  }
  if (in_company < LeastEvidence::kTracks) {
    refuse("tracks of people who were seen together", in_company, LeastEvidence::kTracks);
  }
  const ScenePairs pairs = count_pairs(crops);
  if (pairs.same < LeastEvidence::kPairs) {
    refuse("pairs of crops of one person", pairs.same, LeastEvidence::kPairs);
  }
  if (pairs.different < LeastEvidence::kPairs) {
    refuse("pairs of crops of two people", pairs.different, LeastEvidence::kPairs);
  }
}

double multiplications(const reid::NetworkDescription& network) {
  const auto shapes = network.shapes();
  double sum = 0;
  for (std::size_t i = 0; i < network.layers.size(); ++i) {
    const reid::LayerDescription& layer = network.layers[i];
    if (layer.type != reid::LayerType::conv2d) continue;
    sum += static_cast<double>(shapes[i + 1].image_size()) * layer.kernel_size * layer.kernel_size *
           shapes[i].c;
  }
  return sum;
}

std::string first_trained(reid::EmbeddingNetwork& network) {
  const bool large = multiplications(network.description()) > kLargeNetwork;
  return large ? network.head().name(0) : network.description().layers[0].name;
}

// As training ties it, where its blocks fill the map.
std::optional<BlockGrid> grid_for(const reid::EmbeddingNetwork& network) {
  const nn::Shape map = network.trunk().output_shape(network.input_shape(1));
  const BlockGrid grid;
  if (map.h % grid.rows != 0 || map.w % grid.columns != 0) return std::nullopt;
  return grid;
}

reid::EmbeddingNetwork copy_of(const reid::EmbeddingNetwork& network) {
  reid::EmbeddingNetwork copy(network.description());
  for (std::size_t i = 0; i < copy.state().size(); ++i) {
    *copy.state()[i].value = *network.state()[i].value;
  }
  copy.parameters_changed();
  return copy;
}

TrainerOptions optimiser_options(const AdaptationOptions& options) {
  TrainerOptions result;
  result.iterations = options.iterations;
  result.learning_rate = options.learning_rate;
  result.warmup_iterations = 5;
  result.final_factor = 0.1;
  return result;
}

class Run {
 public:
  Run(reid::Model& model, const SceneLessons& lessons, const AdaptationOptions& options)
      : model_(model),
        lessons_(lessons),
        options_(options),
        network_(model.network, grid_for(model.network), first_trained(model.network), 1.0F),
        start_weights_(copy_of(model.network)),
        start_(start_weights_, grid_for(model.network), first_trained(model.network), 1.0F),
        batches_(lessons.teaching, options.tracks, options.instances, options.seed),
        schedule_(make_schedule(optimiser_options(options))),
        optimizer_(make_optimizer(optimiser_options(options), network_.parameters())) {
    network_.freeze_statistics();
    if (lessons.anchors.empty()) {
      made_up_ =
          made_up_people(lessons.teaching.images, 2 * lessons.teaching.images.size(), options.seed);
    }
    // The distance that tells one person from two best, before anything is learnt.
    unit_ = 1 - curve(lessons.teaching).tau_a_max_accuracy();
  }

  reid::Roc curve(const SceneCrops& crops) { return scene_roc(crops, embed(crops.images)); }

  AdaptationStep step(std::int64_t iteration) {
    const SceneBatches::Batch batch = batches_.batch(iteration);
    const int scene = static_cast<int>(batch.images.size());
    front_ = network_.run_front(patches_of(batch.images, iteration));
    const nn::Tensor& taught = start_.forward(front_, nn::Mode::inference);
    const nn::Tensor& vectors = network_.forward(front_, nn::Mode::training);
    gradient_.resize(vectors.shape());
    gradient_.fill(0.0F);
    const std::size_t labelled = batch.images.size() * vectors.shape().image_size();
    BatchHardOptions triplets;
    triplets.kind = LossKind::triplet;
    triplets.triplet_scale = kTripletScale / unit_;
    AdaptationStep report;
    report.iteration = iteration + 1;
    report.loss = batch_hard_loss<float>(vectors.values().first(labelled), batch.labels,
                                         batch.images, triplets, gradient_.values().first(labelled),
                                         std::cref(lessons_.teaching.met))
                      .loss;
    report.anchor_loss =
        teacher_loss<float>(vectors.values().subspan(labelled), taught.values().subspan(labelled),
                            vectors.shape().n - scene, TeacherMatch::projection,
                            options_.anchor_weight / unit_, gradient_.values().subspan(labelled));
    require_finite_loss(report.loss + report.anchor_loss, report.iteration);
    optimizer_->zero_grad();
    network_.backward(gradient_);
    optimizer_->set_learning_rate(schedule_.at(iteration));
    optimizer_->step();
    network_.parameters_changed();
    return report;
  }

  std::vector<nn::NamedTensor> state() { return network_.state(); }
  // Puts the weights into the model.
  void take(const BestWeights& weights) {
    weights.restore(network_.state());
    network_.parameters_changed();
    network_.store();
  }

 private:
  // Crops of the batch, then as many anchors.
  const nn::Tensor& patches_of(const std::vector<int>& images, std::int64_t iteration) {
    const std::vector<image::Image>& anchors = made_up_.empty() ? lessons_.anchors : made_up_;
    auto random = random_stream(options_.seed, Purpose::scene_anchors, 1,
                                static_cast<std::uint64_t>(iteration));
    std::vector<int> drawn;
    for (std::size_t i = 0; i < images.size(); ++i) {
      drawn.push_back(static_cast<int>(random.below(anchors.size())));
    }
    const image::Preprocessing& preprocessing = model_.metadata.preprocessing;
    make_batch_patches(lessons_.teaching.images, images, 0, iteration, views_of_the_scene(),
                       options_.seed, preprocessing, patches_);
    nn::Tensor others;
    make_batch_patches(anchors, drawn, images.size(), iteration, foreign_colours(), options_.seed,
                       preprocessing, others);
    nn::Shape shape = patches_.shape();
    shape.n *= 2;
    batch_.resize(shape);
    std::copy_n(patches_.data(), patches_.size(), batch_.data());
    std::copy_n(others.data(), others.size(), batch_.image(shape.n / 2));
    return batch_;
  }

  // As a tracker would.
  nn::Tensor embed(const std::vector<image::Image>& images) {
    const int count = static_cast<int>(images.size());
    nn::Tensor result({count, 1, 1, model_.network.embedding_size()});
    for (int first = 0; first < count; first += kAtOnce) {
      std::vector<View> views;
      for (int i = first; i < std::min(count, first + kAtOnce); ++i) views.push_back({i, 0});
      make_view_patches(images, views, {}, options_.seed, model_.metadata.preprocessing, patches_);
      const nn::Tensor& rows = network_.forward(network_.run_front(patches_), nn::Mode::inference);
      std::copy_n(rows.data(), rows.size(), result.image(first));
    }
    return result;
  }

  reid::Model& model_;
  const SceneLessons& lessons_;
  const AdaptationOptions& options_;
  TrainedNetwork network_;
  reid::EmbeddingNetwork start_weights_;
  TrainedNetwork start_;
  SceneBatches batches_;
  nn::LearningRateSchedule schedule_;
  std::unique_ptr<nn::Optimizer> optimizer_;
  std::vector<image::Image> made_up_;
  double unit_ = 1;
  nn::Tensor patches_, batch_, front_, gradient_;
};

}  // namespace

void AdaptationOptions::validate() const {
  io::require(iterations >= 1, "iterations", iterations, ">= 1");
  io::require(tracks >= 2, "tracks", tracks, ">= 2");
  io::require(instances >= 2, "instances", instances, ">= 2");
  io::require(learning_rate > 0, "learning_rate", learning_rate, "> 0");
  io::require(anchor_weight >= 0, "anchor_weight", anchor_weight, ">= 0");
  io::require(score_every >= 1, "score_every", score_every, ">= 1");
  io::require(patience >= 1, "patience", patience, ">= 1");
}

bool Adaptation::gained() const {
  return 1 - after.auc() <= (1 - kLeastGain) * (1 - before.auc()) &&
         after.fpr_at_tpr(kTpr) <= before.fpr_at_tpr(kTpr);
}

Adaptation adapt(reid::Model& model, const SceneLessons& lessons, const AdaptationOptions& options,
                 const std::function<void(const AdaptationStep&)>& progress) {
  options.validate();
  require_evidence(lessons.teaching, "the part that teaches");
  require_evidence(lessons.held_out, "the part held out");
  Run run(model, lessons, options);
  const reid::Roc before = run.curve(lessons.held_out);
  Adaptation result{0, before, before};
  BestWeights start, kept;
  start.keep(run.state(), 0);
  kept = start;
  double most = 0;  // gained in area so far
  int in_vain = 0;
  for (std::int64_t i = 0; i < options.iterations && in_vain < options.patience; ++i) {
    AdaptationStep step = run.step(i);
    std::optional<reid::Roc> scored;
    if (step.iteration % options.score_every == 0 || step.iteration == options.iterations) {
      scored = run.curve(lessons.held_out);
      step.scored = &*scored;
      const double gain = scored->auc() - before.auc();
      most = std::max(most, gain);
      ++in_vain;
      if (gain > 0 && gain >= kKeptGain * most) {
        in_vain = 0;
        kept.keep(run.state(), step.iteration);
        result.iterations = step.iteration;
        result.after = *scored;
      }
    }
    progress(step);
  }
  run.take(result.gained() ? kept : start);
  return result;
}

}  // namespace sdmt::train
