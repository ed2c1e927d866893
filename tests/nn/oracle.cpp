// SPDX-License-Identifier: Apache-2.0
#include "nn/oracle.h"

#include <algorithm>
#include <cmath>

namespace sdmt::nn::oracle {

Array conv2d(const Array& x, const Array& weight, const Array& bias, int stride, int padding) {
  const int kernel = weight.shape.h;
  Array y({x.shape.n, (x.shape.h + 2 * padding - kernel) / stride + 1,
           (x.shape.w + 2 * padding - kernel) / stride + 1, weight.shape.n});
  for (int n = 0; n < y.shape.n; ++n) {
    for (int i = 0; i < y.shape.h; ++i) {
      for (int j = 0; j < y.shape.w; ++j) {
        for (int o = 0; o < y.shape.c; ++o) {
          double sum = bias.values.empty() ? 0.0 : bias.values[static_cast<std::size_t>(o)];
          for (int u = 0; u < kernel; ++u) {
            for (int v = 0; v < kernel; ++v) {
              const int row = i * stride + u - padding;
              const int column = j * stride + v - padding;
              if (row < 0 || row >= x.shape.h || column < 0 || column >= x.shape.w) continue;
              for (int c = 0; c < x.shape.c; ++c) {
                sum += x.at(n, row, column, c) * weight.at(o, u, v, c);
              }
            }
          }
          y.at(n, i, j, o) = sum;
        }
      }
    }
  }
  return y;
}

Array linear(const Array& x, const Array& weight, const Array& bias) {
  const int in = weight.shape.c;
  Array y({x.shape.n, 1, 1, weight.shape.n});
  for (int n = 0; n < x.shape.n; ++n) {
    for (int o = 0; o < weight.shape.n; ++o) {
      double sum = bias.values.empty() ? 0.0 : bias.values[static_cast<std::size_t>(o)];
      for (int i = 0; i < in; ++i) {
        sum += x.values[static_cast<std::size_t>(n) * in + i] * weight.at(o, 0, 0, i);
      }
      y.at(n, 0, 0, o) = sum;
    }
  }
  return y;
}

Array relu(const Array& x) {
  Array y = x;
  for (double& value : y.values) value = std::max(value, 0.0);
  return y;
}

Array max_pool2d(const Array& x) {
  Array y({x.shape.n, x.shape.h / 2, x.shape.w / 2, x.shape.c});
  for (int n = 0; n < y.shape.n; ++n) {
    for (int i = 0; i < y.shape.h; ++i) {
      for (int j = 0; j < y.shape.w; ++j) {
        for (int c = 0; c < y.shape.c; ++c) {
          double largest = x.at(n, 2 * i, 2 * j, c);
          for (int u = 0; u < 2; ++u) {
            for (int v = 0; v < 2; ++v) {
              largest = std::max(largest, x.at(n, 2 * i + u, 2 * j + v, c));
            }
          }
          y.at(n, i, j, c) = largest;
        }
      }
    }
  }
  return y;
}

Array batch_norm_training(const Array& x, const Array& weight, const Array& bias, double eps) {
  const int channels = x.shape.c;
  Array mean({1, 1, 1, channels});
  Array var({1, 1, 1, channels});
  const double count = static_cast<double>(x.values.size()) / channels;
  for (std::size_t i = 0; i < x.values.size(); ++i)
    mean.values[i % channels] += x.values[i] / count;
  for (std::size_t i = 0; i < x.values.size(); ++i) {
    const double centred = x.values[i] - mean.values[i % channels];
    var.values[i % channels] += centred * centred / count;
  }
  return batch_norm_inference(x, weight, bias, mean, var, eps);
}

Array batch_norm_inference(const Array& x, const Array& weight, const Array& bias,
                           const Array& mean, const Array& var, double eps) {
  Array y = x;
  for (std::size_t i = 0; i < x.values.size(); ++i) {
    const std::size_t c = i % static_cast<std::size_t>(x.shape.c);
    y.values[i] =
        (x.values[i] - mean.values[c]) / std::sqrt(var.values[c] + eps) * weight.values[c] +
        bias.values[c];
  }
  return y;
}

Array instance_norm(const Array& x, const Array& weight, const Array& bias, double eps) {
  Array y = x;
  const std::size_t size = x.shape.image_size();
  for (std::size_t n = 0; n < static_cast<std::size_t>(x.shape.n); ++n) {
    Array image({1, x.shape.h, x.shape.w, x.shape.c});
    std::copy_n(x.values.begin() + static_cast<std::ptrdiff_t>(n * size), size,
                image.values.begin());
    const Array normalised = batch_norm_training(image, weight, bias, eps);
    std::copy_n(normalised.values.begin(), size,
                y.values.begin() + static_cast<std::ptrdiff_t>(n * size));
  }
  return y;
}

Array l2_normalize(const Array& x, double eps) {
  Array y = x;
  const std::size_t size = x.shape.image_size();
  for (std::size_t n = 0; n < static_cast<std::size_t>(x.shape.n); ++n) {
    double sum = 0.0;
    for (std::size_t i = 0; i < size; ++i) sum += x.values[n * size + i] * x.values[n * size + i];
    for (std::size_t i = 0; i < size; ++i) y.values[n * size + i] /= std::max(std::sqrt(sum), eps);
  }
  return y;
}

}  // namespace sdmt::nn::oracle
