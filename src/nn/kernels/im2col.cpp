// SPDX-License-Identifier: Apache-2.0
#include "kernels/im2col.h"

#include <algorithm>
#include <cstddef>

namespace sdmt::nn {

namespace {

/// Calls run(row offset, image offset or -1 for padding, length) for every stretch of a window that
/// is contiguous in both.
template <typename Run>
void for_each_stretch(const WindowGeometry& g, std::int64_t window, const Run& run) {
  const int top = static_cast<int>(window / g.out_width) * g.stride - g.padding;
  const int left = static_cast<int>(window % g.out_width) * g.stride - g.padding;
  const std::int64_t row_length = std::int64_t{g.kernel} * g.channels;
  const int inside_begin = std::clamp(-left, 0, g.kernel);  // columns of the window in the image
  const int inside_end = std::clamp(g.width - left, inside_begin, g.kernel);
  for (int u = 0; u < g.kernel; ++u) {
    const std::int64_t to = u * row_length;
    const int y = top + u;
    if (y < 0 || y >= g.height || inside_begin == inside_end) {
      run(to, std::int64_t{-1}, row_length);
      continue;
    }
    const std::int64_t before = std::int64_t{inside_begin} * g.channels;
    const std::int64_t inside = std::int64_t{inside_end - inside_begin} * g.channels;
    const std::int64_t from = (std::int64_t{y} * g.width + left + inside_begin) * g.channels;
    run(to, std::int64_t{-1}, before);
    run(to + before, from, inside);
    run(to + before + inside, std::int64_t{-1}, row_length - before - inside);
  }
}

}  // namespace

void im2col(const WindowGeometry& g, const float* image, std::int64_t first, std::int64_t count,
            float* rows) {
  for (std::int64_t window = first; window < first + count; ++window, rows += g.window_size()) {
    for_each_stretch(g, window, [=](std::int64_t to, std::int64_t from, std::int64_t length) {
      if (from < 0) {
        std::fill_n(rows + to, length, 0.0F);
      } else {
        std::copy_n(image + from, length, rows + to);
      }
    });
  }
}

void col2im_add(const WindowGeometry& g, const float* rows, std::int64_t first, std::int64_t count,
                float* image) {
  for (std::int64_t window = first; window < first + count; ++window, rows += g.window_size()) {
    for_each_stretch(g, window, [=](std::int64_t to, std::int64_t from, std::int64_t length) {
      if (from < 0) return;
      for (std::int64_t i = 0; i < length; ++i) image[from + i] += rows[to + i];
    });
  }
}

}  // namespace sdmt::nn
