// SPDX-License-Identifier: Apache-2.0
#include <sdmt/tuning/tuning_run.h>

#include <cstdio>
#include <exception>

int main() {
  try {
    sdmt::tuning::run_tuning(
        {}, {}, [](std::int64_t) {}, [] { return false; });
  } catch (const std::exception& error) {
    std::puts(error.what());
  }
}
