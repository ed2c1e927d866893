// SPDX-License-Identifier: Apache-2.0
// What GCC's OpenMP run-time finds in its environment. It reads it when it is started, before
// main(); it is linked into the binary, with the usual priority, so this comes first.
//
// Its threads spin for milliseconds while they wait for work. Beside other load, a second
// sdmt for instance, they take the time of those that have some: runs become several times slower.
// Here they sleep soon instead, unless the user has said how they shall wait.
//
// OMP_STACKSIZE may be too small for any work, which would end in a crash; it is then passed over.
#include <cstdlib>
#include <initializer_list>

namespace {

constexpr int kFirst = 101;  // lower priorities are the compiler's

__attribute__((constructor(kFirst))) void wait_passively() {
  if (std::getenv("OMP_WAIT_POLICY") != nullptr) return;
  // About ten microseconds: loops that follow each other find their threads awake.
  setenv("GOMP_SPINCOUNT", "2000", 0);
}

// Bytes of "64", "64k", "1 M": kilobytes where nothing is said, as OpenMP has it.
double bytes_of(const char* size) {
  char* unit = nullptr;
  const double number = std::strtod(size, &unit);
  while (*unit == ' ') ++unit;
  constexpr double kKilo = 1024;
  switch (*unit) {
    case 'b':
    case 'B':
      return number;
    case 'm':
    case 'M':
      return number * kKilo * kKilo;
    case 'g':
    case 'G':
      return number * kKilo * kKilo * kKilo;
    default:
      return number * kKilo;
  }
}

__attribute__((constructor(kFirst))) void keep_stacks_large_enough() {
  constexpr double kLeast = 256 * 1024;
  for (const char* name : {"OMP_STACKSIZE", "GOMP_STACKSIZE"}) {
    const char* size = std::getenv(name);
    if (size != nullptr && bytes_of(size) < kLeast) unsetenv(name);
  }
}

}  // namespace
