// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "sdmt/nn/simd_target.h"

namespace sdmt::nn {

/// A test that runs once for every instruction set of this machine.
class EveryTarget : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { use_simd_target(GetParam()); }
  void TearDown() override { use_simd_target(""); }
};

inline std::string target_name(const testing::TestParamInfo<std::string>& info) {
  return info.param;
}

#define SDMT_INSTANTIATE_EVERY_TARGET(suite)                                       \
  INSTANTIATE_TEST_SUITE_P(, suite, testing::ValuesIn(::sdmt::nn::simd_targets()), \
                           ::sdmt::nn::target_name)

}  // namespace sdmt::nn
