// SPDX-License-Identifier: Apache-2.0
#include <sdmt/track/tracker.h>

#include <cstdio>
#include <vector>

int main() {
  sdmt::track::Tracker tracker;
  tracker.update(std::vector<sdmt::mot::Detection>{{{1, 1, 40, 90}, 0.9}});
  tracker.finish();
  std::printf("%lld frame\n", static_cast<long long>(tracker.stats().frames));
}
