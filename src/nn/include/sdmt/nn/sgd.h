// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/optimizer.h"

namespace sdmt::nn {

struct SgdOptions {
  double learning_rate = 0.01;  ///< >= 0
  double momentum = 0.9;        ///< in [0,1)
  double weight_decay = 0.0;    ///< >= 0

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// Stochastic gradient descent with momentum, as torch.optim.SGD:
/// g += weight_decay * w;  b = momentum * b + g;  w -= learning_rate * b, with b starting at 0.
class Sgd : public Optimizer {
 public:
  /// The parameters must outlive the optimiser. Throws as SgdOptions::validate().
  Sgd(std::vector<NamedParameter> parameters, SgdOptions options);

  void step() override;
  /// "<parameter>.momentum_buffer" for each parameter.
  std::vector<NamedTensor> state() override;

 private:
  SgdOptions options_;
  std::vector<Tensor> momentum_;
};

}  // namespace sdmt::nn
