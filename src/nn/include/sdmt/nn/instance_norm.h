// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/nn/norm_layer.h"

namespace sdmt::nn {

struct ChannelStatistics;

struct InstanceNormOptions {
  int num_features = 0;        ///< channels, >= 1
  double eps = 1e-5;           ///< added to the variance, > 0
  float initial_gamma = 1.0F;  ///< start of `weight`
  float initial_beta = 0.0F;   ///< start of `bias`

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// Instance normalisation over the positions of a channel in one image (Ulyanov, Vedaldi &
/// Lempitsky, 2016), as torch.nn.InstanceNorm2d with affine=True: y = (x - mean) / sqrt(var + eps)
/// * weight + bias, with the mean and biased variance of the image itself in both modes. It takes
/// away what a camera and its light do to a whole picture, so that networks with it in their first
/// layers go on working on other cameras (Pan et al., "Two at Once", 2018); further up it would
/// take away what people are told apart by.
class InstanceNorm : public NormLayer {
 public:
  /// Throws as InstanceNormOptions::validate().
  explicit InstanceNorm(InstanceNormOptions options);
  ~InstanceNorm() override;

  const InstanceNormOptions& options() const { return options_; }

  std::string_view type() const override { return "InstanceNorm2d"; }
  /// Throws std::invalid_argument for other channels and for a map of a single position.
  Shape output_shape(Shape in) const override;
  void infer(const Tensor& x, Tensor& y) const override;

 private:
  friend class InferencePlan;  // runs it together with the ReLU after it
  void train(const Tensor& x, Tensor& y, bool relu) override;
  void gradients(const Tensor& x, const Tensor& dy, Tensor* dx, bool relu) override;
  /// With relu, a ReLU after it; the statistics of each image go to `kept` unless it is null.
  void normalise(const Tensor& x, Tensor& y, bool relu, ChannelStatistics* kept) const;

  InstanceNormOptions options_;
  std::vector<ChannelStatistics> images_;  // of the last forward in training mode
};

}  // namespace sdmt::nn
