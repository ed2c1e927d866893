// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/optimizer.h"

namespace sdmt::nn {

struct AdamOptions {
  double learning_rate = 1e-3;  ///< >= 0
  double beta1 = 0.9;           ///< in [0,1)
  double beta2 = 0.999;         ///< in [0,1)
  double eps = 1e-8;            ///< > 0
  double weight_decay = 0.0;    ///< >= 0; added to the gradient (coupled), as torch.optim.Adam

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// Adam (Kingma & Ba, 2015), as torch.optim.Adam:
/// g += weight_decay * w;  m = beta1 m + (1 - beta1) g;  v = beta2 v + (1 - beta2) g^2;
/// w -= learning_rate / (1 - beta1^t) * m / (sqrt(v / (1 - beta2^t)) + eps),
/// with t counting the steps of that parameter.
class Adam : public Optimizer {
 public:
  /// The parameters must outlive the optimiser. Throws as AdamOptions::validate().
  Adam(std::vector<NamedParameter> parameters, AdamOptions options);

  void step() override;
  /// "<parameter>.exp_avg", ".exp_avg_sq" and ".step" ([1,1,1,1]) for each parameter.
  std::vector<NamedTensor> state() override;

 private:
  struct Moments {
    Tensor first, second;
    Tensor step;  // one value; exact in float32 up to 2^24
  };

  AdamOptions options_;
  std::vector<Moments> moments_;
};

}  // namespace sdmt::nn
