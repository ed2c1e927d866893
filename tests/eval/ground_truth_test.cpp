// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/ground_truth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace sdmt::eval {
namespace {

TEST(FindSequences, SaysWhatIsThereInPlaceOfAFolder) {
  const auto file =
      std::filesystem::path(testing::TempDir()) / (std::to_string(::getpid()) + "-gt.txt");
  EXPECT_THAT([&] { find_sequences(file); },
              testing::ThrowsMessage<std::invalid_argument>(file.string() + ": no such folder"));
  std::ofstream(file) << "1,1,1,1,5,5,1\n";
  EXPECT_THAT([&] { find_sequences(file); },
              testing::ThrowsMessage<std::invalid_argument>(
                  testing::HasSubstr("gt.txt: is a file, expected the folder of the sequence")));
}

}  // namespace
}  // namespace sdmt::eval
