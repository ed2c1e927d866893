// SPDX-License-Identifier: Apache-2.0
// One call into each component, so that a missing file or library shows.
#include <sdmt/eval/clear.h>
#include <sdmt/nn/conv2d.h>
#include <sdmt/reid/embedding_network.h>
#include <sdmt/reid/roc.h>
#include <sdmt/track/tracker.h>
#include <sdmt/train/pk_sampler.h>

#include <cstdio>
#include <vector>

int main() {
  sdmt::nn::Conv2d convolution({.in_channels = 3, .out_channels = 4});
  sdmt::track::Tracker tracker;
  tracker.update(std::vector<sdmt::track::Detection>{{{1, 1, 40, 90}, 0.9}});
  tracker.finish();
  const std::vector<float> near{0.1F, 0.2F};
  const std::vector<float> far{0.7F, 0.9F};
  const double auc = sdmt::train::Roc(near, far).auc();
  const auto scores = sdmt::eval::combine({}, sdmt::eval::Compat::trackeval);
  std::printf("auc %.1f frames %lld boxes %lld\n", auc,
              static_cast<long long>(tracker.stats().frames),
              static_cast<long long>(scores.clr_tp));
}
