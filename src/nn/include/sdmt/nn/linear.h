// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>

#include "sdmt/nn/layer.h"
#include "sdmt/nn/random.h"

namespace sdmt::nn {

class GradientSum;
class HalfWeights;

struct LinearOptions {
  int in_features = 0;   ///< >= 1
  int out_features = 0;  ///< >= 1
  bool bias = true;

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// y = x W^T + b, as torch.nn.Linear. x is [n,h,w,c] with h*w*c == in_features, read in memory
/// order (h, then w, then c); y is [n,1,1,out_features]. Inference reads large weights that are all
/// float16 numbers, as those of a file that stores float16 are, from a copy in float16.
class Linear : public Layer {
 public:
  /// Weights and biases are zero until set or reset_parameters(). Throws as
  /// LinearOptions::validate().
  explicit Linear(LinearOptions options);
  ~Linear() override;

  const LinearOptions& options() const { return options_; }

  /// [out_features, 1, 1, in_features]
  Parameter& weight() { return weight_; }
  /// [1,1,1,out_features]; empty without bias.
  Parameter& bias() { return bias_; }

  /// He initialisation: weights normal with variance 2 / in_features, biases zero.
  void reset_parameters(Random& random);

  std::string_view type() const override { return "Linear"; }
  Shape output_shape(Shape in) const override;
  void infer(const Tensor& x, Tensor& y) const override;
  void forward(const Tensor& x, Tensor& y, Mode mode) override;
  /// Does not read y.
  void backward(const Tensor& x, const Tensor& y, const Tensor& dy, Tensor* dx) override;
  std::vector<Parameter*> parameters() override;
  void parameters_changed() override;
  /// Gives up the weights where inference reads its own copy of them, to save memory: weight() is
  /// then empty, and training throws std::logic_error.
  void release_weights();

 private:
  void multiply(const Tensor& x, bool half, Tensor& y) const;
  bool has_half_weights() const;
  void require_weights() const;
  void add_parameter_gradients(const Tensor& x, const Tensor& dy);

  LinearOptions options_;
  Parameter weight_;
  Parameter bias_;
  mutable std::mutex making_half_weights_;
  std::unique_ptr<HalfWeights> half_weights_;  // made when first needed
  mutable bool half_weights_tried_ = false;
  std::unique_ptr<GradientSum> weight_sum_;
  std::unique_ptr<GradientSum> bias_sum_;
};

}  // namespace sdmt::nn
