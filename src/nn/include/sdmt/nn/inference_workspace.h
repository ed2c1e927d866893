// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

/// What lies between the layers of a network while it runs in inference. The memory is used again,
/// so that running shapes seen before allocates nothing. A network may run in several threads at
/// once, each with a workspace of its own; a workspace serves one run at a time.
struct InferenceWorkspace {
  Tensor results[2];
  Tensor joined;  ///< results of groups of images
};

}  // namespace sdmt::nn
