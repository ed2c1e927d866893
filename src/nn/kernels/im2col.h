// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace sdmt::nn {

/// What a square convolution window sees: one image [height, width, channels] and where its windows
/// lie.
struct WindowGeometry {
  int height, width, channels;  // of the input
  int kernel, stride, padding;
  int out_height, out_width;

  std::int64_t window_size() const { return std::int64_t{kernel} * kernel * channels; }
  std::int64_t windows() const { return std::int64_t{out_height} * out_width; }
};

/// Writes windows [first, first + count) of an image, in the order of output pixels, as rows of
/// window_size() values; zeros where a window leaves the image.
void im2col(const WindowGeometry& g, const float* image, std::int64_t first, std::int64_t count,
            float* rows);

/// The adjoint: adds the rows of windows [first, first + count) back onto the image.
void col2im_add(const WindowGeometry& g, const float* rows, std::int64_t first, std::int64_t count,
                float* image);

}  // namespace sdmt::nn
