// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/nn/tensor.h"
#include "sdmt/reid/pair_curve.h"

namespace sdmt::reid {

/// Area under the ROC curve of all pairs of a validation set, whose image i has row i of
/// `embeddings` and labels[i]: what `sdmt validate-roc` calls person-only. Throws as pair_curve().
double validation_auc(nn::Tensor embeddings, const std::vector<int>& labels,
                      const PairDistance& distance = {});

}  // namespace sdmt::reid
