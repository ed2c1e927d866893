// SPDX-License-Identifier: Apache-2.0
#include <sdmt/eval/clear.h>

#include <cstdio>

int main() {
  const auto scores = sdmt::eval::combine(std::span<const sdmt::eval::ClearScores>(),
                                          sdmt::eval::Compat::trackeval);
  std::printf("%lld matches\n", static_cast<long long>(scores.clr_tp));
}
