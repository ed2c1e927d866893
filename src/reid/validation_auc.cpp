// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/validation_auc.h"

#include <utility>

#include "sdmt/reid/market1501.h"

namespace sdmt::reid {

double validation_auc(nn::Tensor embeddings, const std::vector<int>& labels,
                      const PairDistance& distance) {
  LabelledEmbeddings images{std::move(embeddings), {}, std::vector<int>(labels.size(), 0)};
  // Labels count from 0, which as a pid would be background.
  for (const int label : labels) images.pids.push_back(label + 1 + kDistractorPid);
  return pair_curve(images, {}, distance).roc.auc();
}

}  // namespace sdmt::reid
