// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/market1501.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <stdexcept>
#include <string>

#include "reid/temporary_data.h"

namespace sdmt::reid {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no exception";
}

std::vector<std::string> names(const std::vector<ReidImage>& images) {
  std::vector<std::string> result;
  for (const auto& image : images) result.push_back(image.path.filename().string());
  return result;
}

TEST(Market1501, ReadsNamesAsPublished) {
  const TemporaryData data;
  // The names of the data set itself, with the Windows thumbnails that it really contains.
  for (const char* name :
       {"1501_c6s4_001902_01.jpg", "0002_c1s1_000451_03.jpg", "-1_c3s1_000001_02.jpg",
        "0000_c1s1_000151_01.jpg", "Thumbs.db", "0002_c2s1_000301_01.PNG", "0007_c3.jpeg"}) {
    data.touch(name);
  }
  const auto images = list_reid_images(data.path());
  EXPECT_THAT(names(images),
              ElementsAre("0000_c1s1_000151_01.jpg", "0002_c1s1_000451_03.jpg",
                          "0002_c2s1_000301_01.PNG", "0007_c3.jpeg", "1501_c6s4_001902_01.jpg"));
  EXPECT_EQ(images[0].pid, kDistractorPid);
  EXPECT_EQ(images[2].pid, 2);
  EXPECT_EQ(images[2].camid, 2);
  EXPECT_EQ(images[4].pid, 1501);
  EXPECT_EQ(images[4].camid, 6);
}

TEST(Market1501, NamesThatDoNotParseAreNamed) {
  for (const char* name :
       {"person.jpg", "0002.jpg", "0002_1.jpg", "0002_c.jpg", "-2_c1.jpg", "_c1.jpg",
        "99999999999_c1.jpg", "0002_c99999999999.jpg", "0002_c-1.jpg", "12a_c1.jpg"}) {
    const TemporaryData data;
    data.touch("0001_c1s1_000001_00.jpg");
    data.touch(name);
    EXPECT_THAT(message_of([&] { list_reid_images(data.path()); }), HasSubstr(name));
  }
}

TEST(Market1501, ANumberThatIsTooLargeIsSaidToBe) {
  const TemporaryData data;
  data.touch("10001000000000_c1s1_000001_00.jpg");
  EXPECT_THAT(message_of([&] { list_reid_images(data.path()); }),
              HasSubstr("10001000000000_c1s1_000001_00.jpg: the person's number is out of range, "
                        "expected at most 2147483647"));
}

TEST(Market1501, EmptyOrMissingFoldersAreNamed) {
  const TemporaryData data;
  data.touch("readme.txt");
  EXPECT_THAT(message_of([&] { list_reid_images(data.path()); }),
              HasSubstr(data.path().string() + ": holds no .jpg or .png image"));
  EXPECT_THAT(message_of([&] { list_reid_images(data.path()); }),
              HasSubstr("but 1 files of other kinds"));
  data.touch("anna/1.jpg");  // a folder for each person
  data.touch("ben/1.jpg");
  EXPECT_THAT(message_of([&] { list_reid_images(data.path()); }),
              HasSubstr("but 2 folders; images of all people belong into one, named PID_cCAM"));
  EXPECT_THAT(message_of([&] { list_reid_images(data.path() / "no"); }),
              HasSubstr("/no: no such folder"));
  EXPECT_THAT(message_of([&] { split_folder(data.path(), Split::query); }),
              HasSubstr("has no folder query"));
  EXPECT_THAT(message_of([&] { split_folder(data.path() / "no", Split::train); }),
              HasSubstr("has no folder bounding_box_train"));
}

TEST(Market1501, SplitsLieInTheirFolders) {
  const TemporaryData data;
  EXPECT_EQ(split_folder(data.path(), Split::train), data.path());  // a folder of images
  data.touch("query/0001_c1s1_000001_00.jpg");
  data.touch("bounding_box_test/0000_c1s1_000001_00.jpg");
  data.touch("bounding_box_test/0001_c2s1_000001_00.jpg");
  data.touch("bounding_box_test/-1_c2s1_000001_00.jpg");
  data.touch("bounding_box_train/0009_c2s1_000001_00.jpg");
  EXPECT_EQ(split_folder(data.path(), Split::train), data.path() / "bounding_box_train");
  EXPECT_THAT(names(list_validation_images(data.path())),
              ElementsAre("0001_c1s1_000001_00.jpg", "0001_c2s1_000001_00.jpg"));
}

TEST(Market1501, TheRealDataSetsHaveTheirKnownSizes) {
  const std::filesystem::path data = SDMT_DATA_DIR;
  if (!std::filesystem::exists(data)) GTEST_SKIP() << data << " is not there";
  EXPECT_EQ(list_reid_images(split_folder(data / "cuhk03", Split::train)).size(), 11066u);
  EXPECT_EQ(list_validation_images(data / "cuhk03").size(), 208u + 794u);
  EXPECT_EQ(list_reid_images(split_folder(data / "pku-reid", Split::train)).size(), 800u);
  EXPECT_EQ(list_validation_images(data / "pku-reid").size(), 24u + 168u);
  EXPECT_EQ(list_reid_images(split_folder(data / "con-reid", Split::train)).size(), 3328u);
}

}  // namespace
}  // namespace sdmt::reid
