// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/augmentation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace sdmt::train {

namespace {

// The crop between steps: 0..255 in float, interleaved BGR.
struct Canvas {
  int width;
  int height;
  std::vector<float> values;

  Canvas(int w, int h)
      : width(w),
        height(h),
        values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * 3) {}

  float* at(int x, int y) {
    return values.data() + (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(x)) *
                               3;
  }
  // Beyond the edge, the edge.
  const float* near(int x, int y) const {
    return const_cast<Canvas*>(this)->at(std::clamp(x, 0, width - 1), std::clamp(y, 0, height - 1));
  }
};

Canvas to_canvas(const image::Image& image) {
  Canvas canvas(image.width, image.height);
  std::copy(image.bgr.begin(), image.bgr.end(), canvas.values.begin());
  return canvas;
}

// Where a sample lies between two pixels of a line.
struct Between {
  int first = 0;  // pixels, within the line
  int second = 0;
  float weight = 0;  // of the second
};

Between between(double at, int count) {
  const double floor = std::floor(at);
  const int first = static_cast<int>(floor);
  return {std::clamp(first, 0, count - 1), std::clamp(first + 1, 0, count - 1),
          static_cast<float>(at - floor)};
}

// The box (left, top, width, height) of `source`, resampled to the size of `out`.
void sample_box(const Canvas& source, double left, double top, double box_width, double box_height,
                bool mirror, Canvas& out) {
  std::vector<Between> columns;
  for (int x = 0; x < out.width; ++x) {
    const int column = mirror ? out.width - 1 - x : x;
    columns.push_back(between(left + (column + 0.5) * box_width / out.width - 0.5, source.width));
  }
  for (int y = 0; y < out.height; ++y) {
    const Between row = between(top + (y + 0.5) * box_height / out.height - 0.5, source.height);
    const float* above = source.near(0, row.first);
    const float* below = source.near(0, row.second);
    float* to = out.at(0, y);
    for (const Between& column : columns) {
      const int l = 3 * column.first, r = 3 * column.second;
      for (int k = 0; k < 3; ++k) {
        *to++ =
            (1 - row.weight) * ((1 - column.weight) * above[l + k] + column.weight * above[r + k]) +
            row.weight * ((1 - column.weight) * below[l + k] + column.weight * below[r + k]);
      }
    }
  }
}

// One line of `count` samples averaged down to `out_count` by covered length.
void shrink_line(const float* in, int count, int stride, float* out, int out_count,
                 int out_stride) {
  const double ratio = static_cast<double>(count) / out_count;
  for (int i = 0; i < out_count; ++i) {
    const double begin = i * ratio, end = (i + 1) * ratio;
    double sum = 0;
    for (int j = static_cast<int>(begin); j < count && j < end; ++j) {
      sum += in[j * stride] * (std::min<double>(end, j + 1) - std::max<double>(begin, j));
    }
    out[i * out_stride] = static_cast<float>(sum / ratio);
  }
}

Canvas shrink(const Canvas& in, int width, int height) {
  Canvas rows(width, in.height);
  for (int y = 0; y < in.height; ++y) {
    for (int k = 0; k < 3; ++k) {
      shrink_line(in.near(0, y) + k, in.width, 3, rows.at(0, y) + k, width, 3);
    }
  }
  Canvas out(width, height);
  for (int i = 0; i < width * 3; ++i) {
    shrink_line(rows.values.data() + i, in.height, width * 3, out.values.data() + i, height,
                width * 3);
  }
  return out;
}

void lower_resolution(Canvas& canvas, double factor) {
  const Canvas small = shrink(canvas, std::max(1, static_cast<int>(canvas.width * factor)),
                              std::max(1, static_cast<int>(canvas.height * factor)));
  sample_box(small, 0, 0, small.width, small.height, false, canvas);
}

constexpr int kRadius = 4;  // of the blur
using BlurWeights = std::array<float, kRadius + 1>;

// One line of the result: the sum of the lines line(-kRadius) .. line(kRadius), weighted.
template <typename Line>
void add_weighted(const BlurWeights& weights, float* out, int count, Line line) {
  std::fill_n(out, count, 0.0F);
  for (int i = -kRadius; i <= kRadius; ++i) {
    const float* from = line(i);
    const float weight = weights[std::abs(i)];
    for (int k = 0; k < count; ++k) out[k] += weight * from[k];
  }
}

void gaussian_blur(Canvas& canvas, double sigma) {
  BlurWeights weights{};
  float sum = 0;
  for (int i = 0; i <= kRadius; ++i) {
    weights[i] = static_cast<float>(std::exp(-i * i / (2 * sigma * sigma)));
    sum += (i == 0 ? 1 : 2) * weights[i];
  }
  for (float& weight : weights) weight /= sum;
  const Canvas source = canvas;
  const int row_size = 3 * canvas.width;
  std::vector<float> padded(static_cast<std::size_t>(row_size + 6 * kRadius));
  for (int y = 0; y < canvas.height; ++y) {
    for (int x = -kRadius; x < canvas.width + kRadius; ++x) {
      std::copy_n(source.near(x, y), 3, padded.data() + 3 * (x + kRadius));
    }
    add_weighted(weights, canvas.at(0, y), row_size,
                 [&](int i) { return padded.data() + 3 * (i + kRadius); });
  }
  const Canvas rows = canvas;
  for (int y = 0; y < canvas.height; ++y) {
    add_weighted(weights, canvas.at(0, y), row_size, [&](int i) { return rows.near(0, y + i); });
  }
}

float luma(const float* bgr) { return 0.114F * bgr[0] + 0.587F * bgr[1] + 0.299F * bgr[2]; }

// By a table of the whole values, linear between them.
void change_gamma(Canvas& canvas, double strength, nn::Random& random) {
  constexpr int kLast = 255;
  const double exponent = std::exp(random.uniform(-1, 1) * std::log1p(strength));
  std::array<float, kLast + 2> table{};
  for (int i = 0; i <= kLast; ++i) {
    table[i] = static_cast<float>(kLast * std::pow(static_cast<double>(i) / kLast, exponent));
  }
  table.back() = kLast;
  for (float& value : canvas.values) {
    const int whole = static_cast<int>(value);
    const float* at = table.data() + whole;
    value = at[0] + (value - static_cast<float>(whole)) * (at[1] - at[0]);
  }
}

void change_colour(Canvas& canvas, const AugmentationOptions& options, nn::Random& random) {
  const double contrast = random.uniform(1 - options.contrast, 1 + options.contrast);
  const double gain = std::exp(random.uniform(-1, 1) * std::log1p(options.brightness));
  std::array<float, 3> gains{};
  for (float& g : gains) {
    g = static_cast<float>(gain * random.uniform(1 - options.tint, 1 + options.tint));
  }
  auto saturation = random.uniform(1 - options.saturation, 1 + options.saturation);
  if (random.uniform() < options.grey) saturation = 0;
  const auto s = static_cast<float>(saturation);
  const auto c = static_cast<float>(contrast);
  constexpr float kMiddle = 128;
  for (std::size_t i = 0; i < canvas.values.size(); i += 3) {
    float* p = canvas.values.data() + i;
    const float grey = luma(p);
    for (int k = 0; k < 3; ++k) {
      const float v = grey + s * (p[k] - grey);
      p[k] = std::clamp(((v - kMiddle) * c + kMiddle) * gains[k], 0.0F, 255.0F);
    }
  }
}

void add_offset(Canvas& canvas, double strength, nn::Random& random) {
  const auto offset = static_cast<float>(255 * random.uniform(-strength, strength));
  for (float& value : canvas.values) value = std::clamp(value + offset, 0.0F, 255.0F);
}

// Nearly normal: the sum of four uniform numbers, all from one draw.
void add_noise(Canvas& canvas, double strength, nn::Random& random) {
  constexpr double kUniforms = 4, kRange = 65536;
  const double deviation = strength * random.uniform();
  const auto scale = static_cast<float>(deviation * std::sqrt(12 / kUniforms) / kRange);
  const auto middle = static_cast<float>(kUniforms * (kRange - 1) / 2);
  for (float& value : canvas.values) {
    const std::uint64_t bits = random.next();
    const auto sum = (bits & 0xFFFF) + (bits >> 16 & 0xFFFF) + (bits >> 32 & 0xFFFF) + (bits >> 48);
    value += scale * (static_cast<float>(sum) - middle);
  }
}

// Calls paint(pixel) in a random rectangle.
template <typename Paint>
void paint_rectangle(Canvas& canvas, nn::Random& random, Paint paint) {
  const int height = static_cast<int>(canvas.height * random.uniform(0.1, 0.35));
  const int width = static_cast<int>(canvas.width * random.uniform(0.2, 0.6));
  const auto offset = [&random](int room) {
    return static_cast<int>(random.below(static_cast<std::uint64_t>(room) + 1));
  };
  const int top = offset(canvas.height - height);
  const int left = offset(canvas.width - width);
  for (int y = top; y < top + height; ++y) {
    for (int x = left; x < left + width; ++x) paint(canvas.at(x, y));
  }
}

void erase_rectangle(Canvas& canvas, nn::Random& random) {
  constexpr std::array<float, 3> kMeanColour = {103.5F, 116.3F, 123.7F};  // of ImageNet, BGR
  paint_rectangle(canvas, random,
                  [&](float* pixel) { std::copy(kMeanColour.begin(), kMeanColour.end(), pixel); });
}

void grey_rectangle(Canvas& canvas, nn::Random& random) {
  paint_rectangle(canvas, random, [](float* pixel) { std::fill_n(pixel, 3, luma(pixel)); });
}

image::Image to_image(const Canvas& canvas) {
  image::Image image(canvas.width, canvas.height);
  for (std::size_t i = 0; i < canvas.values.size(); ++i) {
    image.bgr[i] = static_cast<std::uint8_t>(std::clamp(canvas.values[i] + 0.5F, 0.0F, 255.0F));
  }
  return image;
}

}  // namespace

image::Image augment(const image::Image& image, int width, int height,
                     const AugmentationOptions& options, nn::Random& random) {
  const bool mirror = random.uniform() < options.flip;
  const double box_width = image.width * random.uniform(1 - options.scale, 1 + options.scale);
  double box_height = image.height * random.uniform(1 - options.scale, 1 + options.scale);
  const double shift_x = image.width * random.uniform(-options.translate, options.translate);
  const double shift_y = image.height * random.uniform(-options.translate, options.translate);
  const double left = (image.width - box_width) / 2 + shift_x;
  double top = (image.height - box_height) / 2 + shift_y;
  // A change that is off draws no number.
  if (options.crop > 0 && random.uniform() < options.crop) {
    const double lost = box_height * random.uniform(0, 1.0 / 3);
    if (random.uniform() < 0.5) top += lost;
    box_height -= lost;
  }
  Canvas canvas(width, height);
  sample_box(to_canvas(image), left, top, box_width, box_height, mirror, canvas);
  if (options.gamma > 0) change_gamma(canvas, options.gamma, random);
  change_colour(canvas, options, random);
  if (options.offset > 0) add_offset(canvas, options.offset, random);
  if (options.grey_patch > 0 && random.uniform() < options.grey_patch) {
    grey_rectangle(canvas, random);
  }
  if (random.uniform() < options.low_resolution) {
    lower_resolution(canvas, random.uniform(0.35, 0.8));
  }
  if (random.uniform() < options.blur) gaussian_blur(canvas, random.uniform(0.5, 1.5));
  if (options.noise > 0) add_noise(canvas, options.noise, random);
  if (random.uniform() < options.erase) erase_rectangle(canvas, random);
  return to_image(canvas);
}

image::Image flipped(const image::Image& image) {
  image::Image mirror(image.width, image.height);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      std::copy_n(image.pixel(image.width - 1 - x, y), 3, mirror.pixel(x, y));
    }
  }
  return mirror;
}

}  // namespace sdmt::train
