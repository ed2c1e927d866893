// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "sdmt/nn/learning_rate_schedule.h"
#include "sdmt/train/augmentation.h"
#include "sdmt/train/batch_hard_loss.h"
#include "sdmt/train/teacher_loss.h"
#include "sdmt/train/tied_head.h"

namespace sdmt::train {

enum class OptimizerKind { adam, sgd };

/// Every number of a training. Names on the command line, ranges and help are in
/// trainer_option_table().
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

}  // namespace sdmt::train
