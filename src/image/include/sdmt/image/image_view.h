// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace sdmt::image {

/// Order of the three interleaved 8-bit channels in memory.
enum class ChannelOrder { rgb, bgr };

/// An 8-bit, three-channel image in somebody else's memory (a cv::Mat, a camera buffer).
/// Row y starts at data + y * stride; stride is in bytes and >= 3 * width.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width = 0;   ///< pixels
  int height = 0;  ///< pixels
  std::ptrdiff_t stride = 0;
  ChannelOrder order = ChannelOrder::bgr;

  bool empty() const { return data == nullptr || width <= 0 || height <= 0; }
};

}  // namespace sdmt::image
