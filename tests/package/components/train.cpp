// SPDX-License-Identifier: Apache-2.0
#include <sdmt/train/pk_sampler.h>

#include <cstdio>
#include <exception>

int main() {
  try {
    sdmt::train::PkSampler({}, 1, {});
  } catch (const std::exception&) {
    std::puts("no people");
  }
}
