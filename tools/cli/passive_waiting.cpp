// SPDX-License-Identifier: Apache-2.0
//
// GCC's OpenMP threads spin for milliseconds while they wait for work. Beside other load, a second
// sdmt for instance, they take the time of those that have some: runs become several times slower.
// Here they sleep soon instead, unless the user has said how they shall wait. The run-time reads
// its environment when it is started, before main(); it is linked into the binary, with the usual
// priority, so this comes first.
#include <cstdlib>

namespace {

constexpr int kFirst = 101;  // lower priorities are the compiler's

__attribute__((constructor(kFirst))) void wait_passively() {
  if (std::getenv("OMP_WAIT_POLICY") != nullptr) return;
  // About ten microseconds: loops that follow each other find their threads awake.
  setenv("GOMP_SPINCOUNT", "2000", 0);
}

}  // namespace
