// SPDX-License-Identifier: Apache-2.0
#include <sdmt/reid/roc.h>

#include <cstdio>
#include <vector>

int main() {
  const std::vector<float> near{0.1F, 0.2F};
  const std::vector<float> far{0.7F, 0.9F};
  std::printf("auc %.1f\n", sdmt::reid::Roc(near, far).auc());
}
