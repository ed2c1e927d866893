// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "sdmt/image/image_view.h"

namespace sdmt::image {

/// How an 8-bit crop becomes the input of the network: stretched to height x width, channels in
/// `order`, each value v (0..255) turned into (v / 255 - mean) / std. The same for training,
/// validation and tracking; stored in the model file. The defaults are the paper's input size (its
/// table 1) and torchvision's statistics of ImageNet.
struct Preprocessing {
  int height = 128;  ///< pixels, 1..4096
  int width = 64;    ///< pixels, 1..4096
  ChannelOrder order = ChannelOrder::rgb;
  std::array<float, 3> mean{0.485F, 0.456F, 0.406F};  ///< by channel, in `order`; -10..10
  std::array<float, 3> std{0.229F, 0.224F, 0.225F};   ///< by channel, in `order`; 0.001..1000

  /// Throws std::invalid_argument naming the field, its value and the bound.
  void validate() const;

  bool operator==(const Preprocessing&) const = default;
};

}  // namespace sdmt::image
