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

// The box (left, top, width, height) of `source`, resampled to the size of `out`.
void sample_box(const Canvas& source, double left, double top, double box_width, double box_height,
                bool mirror, Canvas& out) {
  for (int y = 0; y < out.height; ++y) {
    const double sy = top + (y + 0.5) * box_height / out.height - 0.5;
    const int y0 = static_cast<int>(std::floor(sy));
    const auto wy = static_cast<float>(sy - y0);
    for (int x = 0; x < out.width; ++x) {
      const int column = mirror ? out.width - 1 - x : x;
      const double sx = left + (column + 0.5) * box_width / out.width - 0.5;
      const int x0 = static_cast<int>(std::floor(sx));
      const auto wx = static_cast<float>(sx - x0);
      const float* a = source.near(x0, y0);
      const float* b = source.near(x0 + 1, y0);
      const float* c = source.near(x0, y0 + 1);
      const float* d = source.near(x0 + 1, y0 + 1);
      float* to = out.at(x, y);
      for (int k = 0; k < 3; ++k) {
        to[k] = (1 - wy) * ((1 - wx) * a[k] + wx * b[k]) + wy * ((1 - wx) * c[k] + wx * d[k]);
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

void gaussian_blur(Canvas& canvas, double sigma) {
  constexpr int kRadius = 4;
  std::array<float, kRadius + 1> weights{};
  float sum = 0;
  for (int i = 0; i <= kRadius; ++i) {
    weights[static_cast<std::size_t>(i)] =
        static_cast<float>(std::exp(-i * i / (2 * sigma * sigma)));
    sum += (i == 0 ? 1 : 2) * weights[static_cast<std::size_t>(i)];
  }
  for (const bool vertical : {false, true}) {
    const Canvas in = canvas;
    for (int y = 0; y < canvas.height; ++y) {
      for (int x = 0; x < canvas.width; ++x) {
        float* to = canvas.at(x, y);
        std::fill_n(to, 3, 0.0F);
        for (int i = -kRadius; i <= kRadius; ++i) {
          const float* from = vertical ? in.near(x, y + i) : in.near(x + i, y);
          const float weight = weights[static_cast<std::size_t>(std::abs(i))] / sum;
          for (int k = 0; k < 3; ++k) to[k] += weight * from[k];
        }
      }
    }
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
    const float luma = 0.114F * p[0] + 0.587F * p[1] + 0.299F * p[2];
    for (int k = 0; k < 3; ++k) {
      const float v = luma + s * (p[k] - luma);
      p[k] = std::clamp(((v - kMiddle) * c + kMiddle) * gains[static_cast<std::size_t>(k)], 0.0F,
                        255.0F);
    }
  }
}

void erase_rectangle(Canvas& canvas, nn::Random& random) {
  constexpr std::array<float, 3> kMeanColour = {103.5F, 116.3F, 123.7F};  // of ImageNet, BGR
  const int height = static_cast<int>(canvas.height * random.uniform(0.1, 0.35));
  const int width = static_cast<int>(canvas.width * random.uniform(0.2, 0.6));
  const auto offset = [&random](int room) {
    return static_cast<int>(random.below(static_cast<std::uint64_t>(room) + 1));
  };
  const int top = offset(canvas.height - height);
  const int left = offset(canvas.width - width);
  for (int y = top; y < top + height; ++y) {
    for (int x = left; x < left + width; ++x) {
      std::copy(kMeanColour.begin(), kMeanColour.end(), canvas.at(x, y));
    }
  }
}

image::Image to_image(const Canvas& canvas) {
  image::Image image(canvas.width, canvas.height);
  for (std::size_t i = 0; i < canvas.values.size(); ++i) {
    image.bgr[i] = static_cast<std::uint8_t>(std::clamp(canvas.values[i] + 0.5F, 0.0F, 255.0F));
  }
  return image;
}

}  // namespace

void AugmentationOptions::validate() const {
  const auto check = [](const char* field, double value, double upper) {
    if (value >= 0 && value <= upper) return;
    throw std::invalid_argument(std::string(field) + " is " + std::to_string(value) +
                                ", expected 0.." + std::to_string(upper));
  };
  check("flip", flip, 1);
  check("translate", translate, 0.5);
  check("scale", scale, 0.5);
  check("brightness", brightness, 10);
  check("contrast", contrast, 1);
  check("tint", tint, 1);
  check("saturation", saturation, 1);
  check("grey", grey, 1);
  check("low_resolution", low_resolution, 1);
  check("blur", blur, 1);
  check("erase", erase, 1);
}

image::Image augment(const image::Image& image, int width, int height,
                     const AugmentationOptions& options, nn::Random& random) {
  const bool mirror = random.uniform() < options.flip;
  const double box_width = image.width * random.uniform(1 - options.scale, 1 + options.scale);
  const double box_height = image.height * random.uniform(1 - options.scale, 1 + options.scale);
  const double shift_x = image.width * random.uniform(-options.translate, options.translate);
  const double shift_y = image.height * random.uniform(-options.translate, options.translate);
  Canvas canvas(width, height);
  sample_box(to_canvas(image), (image.width - box_width) / 2 + shift_x,
             (image.height - box_height) / 2 + shift_y, box_width, box_height, mirror, canvas);
  change_colour(canvas, options, random);
  if (random.uniform() < options.low_resolution) {
    lower_resolution(canvas, random.uniform(0.35, 0.8));
  }
  if (random.uniform() < options.blur) gaussian_blur(canvas, random.uniform(0.5, 1.5));
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
