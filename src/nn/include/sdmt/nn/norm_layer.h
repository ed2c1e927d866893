// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/nn/layer.h"

namespace sdmt::nn {

/// What normalisations of channels have in common: y = (x - mean) / sqrt(var + eps) * weight +
/// bias. Of what mean and var are says the class.
class NormLayer : public Layer {
 public:
  Parameter& weight() { return weight_; }  ///< gamma, [1,1,1,num_features]
  Parameter& bias() { return bias_; }      ///< beta, [1,1,1,num_features]

  void forward(const Tensor& x, Tensor& y, Mode mode) final;
  /// Uses the statistics of the last forward in training mode. Does not read y.
  void backward(const Tensor& x, const Tensor& y, const Tensor& dy, Tensor* dx) final;
  std::vector<Parameter*> parameters() final { return {&weight_, &bias_}; }

 protected:
  NormLayer(int num_features, float initial_gamma, float initial_beta);

  const Tensor& gamma() const { return weight_.value; }
  const Tensor& beta() const { return bias_.value; }

 private:
  friend class TrainingPlan;  // runs it together with the ReLU after it
  /// forward() in training mode and, with relu, a ReLU after it.
  virtual void train(const Tensor& x, Tensor& y, bool relu) = 0;
  /// backward() of both.
  virtual void gradients(const Tensor& x, const Tensor& dy, Tensor* dx, bool relu) = 0;

  Parameter weight_;
  Parameter bias_;
};

}  // namespace sdmt::nn
