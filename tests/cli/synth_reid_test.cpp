// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "cli/run_command.h"
#include "sdmt/reid/market1501.h"

namespace sdmt::tests {
namespace {

using testing::HasSubstr;

CommandResult make_set(const std::filesystem::path& folder, const std::string& seed) {
  return run_sdmt({"synth", "reid", "--output", folder, "--identities", "9",
                   "--images-per-identity", "5", "--seed", seed});
}

std::map<int, int> images_by_pid(const std::filesystem::path& root, reid::Split split) {
  std::map<int, int> count;
  for (const auto& image : reid::list_reid_images(reid::split_folder(root, split))) {
    ++count[image.pid];
  }
  return count;
}

TEST(SynthReid, IsAMarketFolderThatOurReaderReads) {
  const TemporaryFolder folder;
  const auto result = make_set(folder / "set", "3");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("9 people, 48 images"));
  const auto train_images = images_by_pid(folder / "set", reid::Split::train);
  const auto query = images_by_pid(folder / "set", reid::Split::query);
  const auto gallery = images_by_pid(folder / "set", reid::Split::gallery);
  EXPECT_EQ(train_images, (std::map<int, int>{{1, 5}, {2, 5}, {3, 5}, {4, 5}, {5, 5}, {6, 5}}));
  EXPECT_EQ(query, (std::map<int, int>{{7, 2}, {8, 2}, {9, 2}}));
  EXPECT_EQ(gallery, (std::map<int, int>{{0, 3}, {7, 3}, {8, 3}, {9, 3}}));
}

TEST(SynthReid, TheSeedDecidesEveryByte) {
  const TemporaryFolder folder;
  ASSERT_EQ(make_set(folder / "a", "5").exit_code, 0);
  ASSERT_EQ(make_set(folder / "b", "5").exit_code, 0);
  ASSERT_EQ(make_set(folder / "c", "6").exit_code, 0);
  for (const std::string file : {"bounding_box_train/0001_c1s1_000000_00.jpg",
                                 "bounding_box_test/0000_c2s1_000001_00.jpg"}) {
    EXPECT_EQ(read_file(folder / ("a/" + file)), read_file(folder / ("b/" + file))) << file;
    EXPECT_NE(read_file(folder / ("a/" + file)), read_file(folder / ("c/" + file))) << file;
  }
}

TEST(SynthReid, RefusesImpossibleOptions) {
  const TemporaryFolder folder;
  const auto few = run_sdmt({"synth", "reid", "--output", folder / "s", "--identities", "3"});
  EXPECT_EQ(few.exit_code, 2);
  EXPECT_THAT(few.err, HasSubstr("identities is 3, expected 4 to 9999"));
  EXPECT_TRUE(folder.listing().empty());
  write_file(folder / "old.txt", "");
  const auto full = run_sdmt({"synth", "reid", "--output", folder.path()});
  EXPECT_EQ(full.exit_code, 2);
  EXPECT_THAT(full.err, HasSubstr("is not empty"));
}

}  // namespace
}  // namespace sdmt::tests
