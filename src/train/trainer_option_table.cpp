// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/trainer_option_table.h"

#include <optional>
#include <string>
#include <string_view>

#include "sdmt/train/pk_sampler.h"
#include "training_parts.h"

namespace sdmt::train {

namespace {

using Table = io::OptionTable<TrainerOptions>;

constexpr io::Range kPositive{.low = 0, .above = true};
constexpr io::Range kNotNegative{.low = 0};
constexpr io::Range kAtLeastOne{.low = 1};
constexpr io::Range kShare{.low = 0, .high = 1};
constexpr io::Range kHalf{.low = 0, .high = 0.5};
constexpr io::Range kFactor{.low = 0, .high = 10};

std::optional<BlockGrid> parse_tie(std::string_view text) {
  if (text == "none") return std::nullopt;
  const auto cross = text.find('x');
  const auto rows = io::parse_number<int>(text.substr(0, cross));
  const auto columns =
      cross == text.npos ? std::nullopt : io::parse_number<int>(text.substr(cross + 1));
  if (!rows || !columns) {
    io::refuse_value("tie", io::quoted(text), "ROWSxCOLUMNS, such as 8x2, or none");
  }
  return BlockGrid{*rows, *columns};
}

std::string tie_text(const std::optional<BlockGrid>& tie) {
  if (!tie) return "none";
  return io::number_text(tie->rows) + "x" + io::number_text(tie->columns);
}

void add_batches(Table& table) {
  table.group("batches")
      .number("iterations", &TrainerOptions::iterations, kAtLeastOne, "steps of the optimiser")
      .number("seed", &TrainerOptions::seed, kNotNegative, "of everything random")
      .number("identities", &TrainerOptions::identities, PkSamplerOptions::kIdentities,
              "people in a batch (P)")
      .number("instances", &TrainerOptions::instances, PkSamplerOptions::kInstances,
              "images of each (K)")
      .number("unlabelled-batch", &TrainerOptions::unlabelled_batch, kNotNegative,
              "images without identities in a batch, beside those of people");
}

void add_losses(Table& table) {
  table.group("loss", &TrainerOptions::loss)
      .choice("loss", &BatchHardOptions::kind,
              {{"contrastive", LossKind::contrastive}, {"triplet", LossKind::triplet}},
              "of the hardest pairs")
      .number("margin", &BatchHardOptions::margin, BatchHardOptions::kMargin,
              "contrastive: how far different people are pushed apart")
      .number("triplet-scale", &BatchHardOptions::triplet_scale, BatchHardOptions::kTripletScale,
              "triplet: steepness of the soft margin");
  table.group("loss")
      .choice("teacher-match", &TrainerOptions::teacher_match,
              {{"projection", TeacherMatch::projection},
               {"relations", TeacherMatch::relations},
               {"similarities", TeacherMatch::similarities}},
              "projection: the teacher's vectors, in their principal axes where they have more "
              "dimensions; relations: dot products of the images of a batch; similarities: which "
              "of the batch's images the teacher would take for which")
      .number("teacher-weight", &TrainerOptions::teacher_weight, kPositive,
              "of the teacher's loss");
}

void add_optimisation(Table& table) {
  table.group("optimisation")
      .value("tie", &TrainerOptions::tie, "blocks of the map that share FC1's weights",
             "ROWSxCOLUMNS or none", parse_tie, tie_text, [](const auto&) {})
      .choice("optimizer", &TrainerOptions::optimizer,
              {{"adam", OptimizerKind::adam}, {"sgd", OptimizerKind::sgd}}, "")
      .number({"lr", "learning_rate"}, &TrainerOptions::learning_rate, kPositive,
              "learning rate of the head")
      .number("trunk-lr-scale", &TrainerOptions::trunk_lr_scale, kPositive,
              "the trunk's, relative to the head's")
      .number("momentum", &TrainerOptions::momentum, {.low = 0, .high = 1, .below = true}, "of sgd")
      .number("weight-decay", &TrainerOptions::weight_decay, kNotNegative,
              "added to the gradient, times the weight")
      .number("clip-norm", &TrainerOptions::clip_norm, kPositive, "largest gradient norm")
      .choice({"schedule", "decay"}, &TrainerOptions::decay,
              {{"cosine", nn::LearningRateDecay::cosine},
               {"exponential", nn::LearningRateDecay::exponential},
               {"constant", nn::LearningRateDecay::constant}},
              "how the learning rate falls")
      .number("decay-start", &TrainerOptions::decay_start, kShare,
              "when it begins to, fraction of the iterations")
      .number({"final-lr", "final_factor"}, &TrainerOptions::final_factor,
              {.low = 0, .high = 1, .above = true}, "last learning rate, relative to the first")
      .number({"warmup", "warmup_iterations"}, &TrainerOptions::warmup_iterations, kNotNegative,
              "iterations in which it rises")
      .number("average", &TrainerOptions::average, {.low = 0, .high = 1, .below = true},
              "moving average of the weights, validated and saved in their place: what a step "
              "keeps of it, such as 0.999; 0: none")
      .number("validate-every", &TrainerOptions::validate_every, kAtLeastOne,
              "iterations between validations");
}

void add_augmentation(Table& table) {
  table.group("augmentation")
      .number("views", &TrainerOptions::views, kNotNegative,
              "ways to look at each image, computed once through the frozen layers; 0: anew in "
              "each iteration");
  table.group("augmentation", &TrainerOptions::augmentation)
      .number("flip", &AugmentationOptions::flip, kShare, "probability of a mirror image")
      .number("translate", &AugmentationOptions::translate, kHalf,
              "shift of the box, fraction of its size")
      .number("scale", &AugmentationOptions::scale, kHalf, "change of the box's size, fraction")
      .number("brightness", &AugmentationOptions::brightness, kFactor,
              "gain of all channels, up to 1 + this")
      .number("contrast", &AugmentationOptions::contrast, kShare, "change of contrast, fraction")
      .number("tint", &AugmentationOptions::tint, kShare, "gain of single channels, fraction")
      .number("saturation", &AugmentationOptions::saturation, kShare,
              "change of saturation, fraction")
      .number("grey", &AugmentationOptions::grey, kShare, "probability of losing all colour")
      .number("low-resolution", &AugmentationOptions::low_resolution, kShare,
              "probability of a lower resolution")
      .number("blur", &AugmentationOptions::blur, kShare, "probability of a blur")
      .number("erase", &AugmentationOptions::erase, kShare, "probability of an erased rectangle")
      .number("crop", &AugmentationOptions::crop, kShare,
              "probability of losing up to a third of the height")
      .number("gamma", &AugmentationOptions::gamma, kFactor, "power of the values, up to 1 + this")
      .number("offset", &AugmentationOptions::offset, kShare,
              "added to all channels, fraction of their range")
      .number("grey-patch", &AugmentationOptions::grey_patch, kShare,
              "probability of a rectangle without colour")
      .number("noise", &AugmentationOptions::noise, {.low = 0, .high = 255},
              "largest deviation of noise, of 255");
}

Table make_table() {
  Table table;
  add_batches(table);
  add_losses(table);
  add_optimisation(table);
  add_augmentation(table);
  return table;
}

}  // namespace

const Table& trainer_option_table() {
  static const Table table = make_table();
  return table;
}

void TrainerOptions::validate() const {
  trainer_option_table().validate(*this);
  sampler_options(*this).validate();
}

}  // namespace sdmt::train
