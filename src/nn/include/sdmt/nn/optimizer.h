// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/nn/layer.h"

namespace sdmt::nn {

/// Changes parameters by their gradients. Parameters that are not `trainable` at the time of a
/// step, or have no gradient yet, are left alone; `lr_scale` multiplies the learning rate; weight
/// decay applies only where `decay` is set. After step() call parameters_changed() of the layers.
class Optimizer {
 public:
  virtual ~Optimizer() = default;
  Optimizer(const Optimizer&) = delete;
  Optimizer& operator=(const Optimizer&) = delete;

  virtual void step() = 0;
  /// Sets all gradients to zero.
  void zero_grad();

  double learning_rate() const { return learning_rate_; }
  /// >= 0; throws std::invalid_argument otherwise.
  void set_learning_rate(double learning_rate);

  /// Everything that determines the steps to come except the learning rate, as tensors to save and
  /// to load into, named after the parameters ("conv1_1.weight.exp_avg"). The shapes are those of a
  /// new optimiser over the same parameters.
  virtual std::vector<NamedTensor> state() = 0;

 protected:
  /// Throws std::invalid_argument for a negative or non-finite rate.
  Optimizer(std::vector<NamedParameter> parameters, double learning_rate);
  const std::vector<NamedParameter>& parameters() const { return parameters_; }
  /// Whether step() may change it now.
  static bool is_stepped(const Parameter& parameter);

 private:
  std::vector<NamedParameter> parameters_;
  double learning_rate_ = 0.0;
};

}  // namespace sdmt::nn
