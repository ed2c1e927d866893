// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/layer.h"

namespace sdmt::nn {

struct AvgPool2dOptions {
  int kernel_height = 1;  ///< pixels, >= 1
  int kernel_width = 1;   ///< pixels, >= 1

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// Mean over blocks that do not overlap (stride = kernel, as torch.nn.AvgPool2d's default), which
/// must fill the map exactly: [n, h, w, c] -> [n, h / kernel_height, w / kernel_width, c].
class AvgPool2d : public Layer {
 public:
  /// Throws as AvgPool2dOptions::validate().
  explicit AvgPool2d(AvgPool2dOptions options);

  std::string_view type() const override { return "AvgPool2d"; }
  Shape output_shape(Shape in) const override;
  void infer(const Tensor& x, Tensor& y) const override;
  /// Reads neither x nor y.
  void backward(const Tensor& x, const Tensor& y, const Tensor& dy, Tensor* dx) override;

 private:
  AvgPool2dOptions options_;
};

}  // namespace sdmt::nn
