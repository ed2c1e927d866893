// SPDX-License-Identifier: Apache-2.0
#include "cli/thread_pool.h"

#include <omp.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <latch>
#include <thread>
#include <vector>

#include "cli/console.h"

namespace sdmt::tools {

namespace {

// How many of `wanted` threads can be alive at once.
int startable(int wanted) {
  std::latch end(1);
  std::vector<std::jthread> threads;
  try {
    threads.reserve(wanted);
    while (static_cast<int>(threads.size()) < wanted) {
      threads.emplace_back([&end] { end.wait(); });
    }
  } catch (const std::exception&) {  // of the limit, or of memory
  }
  end.count_down();
  return static_cast<int>(threads.size());
}

}  // namespace

void start_threads() {
  constexpr int kMost = 1024;  // as --threads takes
  const int wanted = std::min(omp_get_max_threads(), kMost);
  const int started = 1 + startable(wanted - 1);
  if (started < wanted) {
    say(stderr, "sdmt: warning: only {} of {} threads can be started (ulimit -u, ulimit -v)\n",
        started, wanted);
  }
  omp_set_num_threads(started);
  std::atomic<int> running = 0;  // so that the region is no empty one
#pragma omp parallel
  ++running;
}

}  // namespace sdmt::tools
