// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/nn/layer.h"

namespace sdmt::nn {

/// Euclidean norm of all gradients of trainable parameters taken together; when it is above
/// `max_norm` (> 0, infinity never clips) they are scaled by max_norm / (norm + 1e-6), as
/// torch.nn.utils.clip_grad_norm_. Returns the norm before clipping. A norm that is not finite
/// changes nothing. Throws std::invalid_argument for max_norm <= 0 or NaN.
double clip_grad_norm(const std::vector<NamedParameter>& parameters, double max_norm);

}  // namespace sdmt::nn
