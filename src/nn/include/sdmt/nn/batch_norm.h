// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "sdmt/nn/norm_layer.h"

namespace sdmt::nn {

struct ChannelAffine;
struct ChannelStatistics;

struct BatchNormOptions {
  int num_features = 0;        ///< channels, >= 1
  double eps = 1e-5;           ///< added to the variance, > 0
  double momentum = 0.1;       ///< weight of the new batch in the running statistics, in [0,1]
  float initial_gamma = 1.0F;  ///< start of `weight`
  float initial_beta = 0.0F;   ///< start of `bias`

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// Batch normalisation over all positions of a channel, n*h*w of them (Ioffe & Szegedy, 2015), as
/// torch.nn.BatchNorm1d/2d: y = (x - mean) / sqrt(var + eps) * weight + bias.
/// training: mean and biased variance of the batch; running_mean and running_var (unbiased
/// variance) move towards them by `momentum`; std::invalid_argument where a channel has a single
/// value (batch of one) and the statistics are not frozen. inference: the running statistics.
class BatchNorm : public NormLayer {
 public:
  /// running_mean 0, running_var 1. Throws as BatchNormOptions::validate().
  explicit BatchNorm(BatchNormOptions options);
  ~BatchNorm() override;

  const BatchNormOptions& options() const { return options_; }

  Buffer& running_mean() { return running_mean_; }  ///< [1,1,1,num_features]
  Buffer& running_var() { return running_var_; }    ///< [1,1,1,num_features]

  /// Frozen, a training pass normalises by the running statistics, as inference does, and leaves
  /// them as they are: for fine-tuning on few images. weight and bias still learn.
  void freeze_statistics(bool frozen) { frozen_ = frozen; }

  std::string_view type() const override { return "BatchNorm"; }
  Shape output_shape(Shape in) const override;
  void infer(const Tensor& x, Tensor& y) const override;
  std::vector<Buffer*> buffers() override { return {&running_mean_, &running_var_}; }

 private:
  friend class InferencePlan;  // folds it into the convolution before it
  void train(const Tensor& x, Tensor& y, bool relu) override;
  void gradients(const Tensor& x, const Tensor& dy, Tensor* dx, bool relu) override;
  ChannelAffine affine(const ChannelStatistics& statistics) const;
  ChannelStatistics running_statistics() const;
  void move_to_batch(const Tensor& x);

  BatchNormOptions options_;
  Buffer running_mean_;
  Buffer running_var_;
  bool frozen_ = false;
  std::unique_ptr<ChannelStatistics> batch_;  // of the last forward in training mode
};

}  // namespace sdmt::nn
