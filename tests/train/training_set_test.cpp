// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/training_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>

#include "reid/temporary_data.h"

namespace sdmt::train {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string message_of(const TrainingSetOptions& options) {
  try {
    load_training_set(options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no exception";
}

TrainingSetOptions of(const std::filesystem::path& folder) {
  TrainingSetOptions options;
  options.folders = {folder};
  return options;
}

TEST(TrainingSet, PeopleOfSeveralFoldersAreDifferent) {
  const reid::TemporaryData a, b;
  a.write_people(3, 2);
  b.write_people(2, 4, "bounding_box_train");
  TrainingSetOptions options = of(a.path());
  options.folders.push_back(b.path());
  const TrainingSet set = load_training_set(options);
  ASSERT_EQ(set.identities.size(), 5u);
  EXPECT_EQ(set.images.size(), 3u * 2 + 2 * 4);
  EXPECT_EQ(set.sources.size(), 2u);
  EXPECT_EQ(set.identities[0].pid, 1);
  EXPECT_EQ(set.identities[3].pid, 1);
  EXPECT_EQ(set.identities[3].source, 1);
  std::set<int> images;
  for (const auto& identity : set.identities) {
    images.insert(identity.images.begin(), identity.images.end());
  }
  EXPECT_EQ(images.size(), set.images.size());
  EXPECT_TRUE(set.unreadable.empty());
}

TEST(TrainingSet, WhatIsLeftOutIsCountedByReason) {
  const reid::TemporaryData data;
  data.write_people(2, 2);
  data.write_image("0000_c1s1_000001_00.jpg", image::Image(8, 8));
  data.write_image("-1_c1s1_000001_00.jpg", image::Image(8, 8));
  data.write_image("-1_c1s1_000002_00.jpg", image::Image(8, 8));
  data.touch("0001_c1s1_000009_00.bmp");
  data.touch("Thumbs.db");
  data.touch("notes.txt");
  data.touch("._0001_c1s1_000000_00.png");  // what a Mac leaves beside each file
  const TrainingSet set = load_training_set(of(data.path()));
  EXPECT_EQ(set.images.size(), 4u);
  EXPECT_EQ(set.left_out.background, 1u);
  EXPECT_EQ(set.left_out.junk, 2u);
  EXPECT_EQ(set.left_out.other_files, 3u);
  EXPECT_TRUE(set.unreadable.empty());
}

TEST(TrainingSet, LinksThatLeadNowhereCannotBeRead) {
  const reid::TemporaryData data;
  data.write_people(3, 2);
  std::filesystem::create_symlink("gone.png", data.path() / "0001_c1s1_000009_00.png");
  EXPECT_THAT(message_of(of(data.path())), HasSubstr("1 of 7 images cannot be read"));
}

TEST(TrainingSet, AnImageOfOnePixelIsNamed) {
  const reid::TemporaryData data;
  data.write_people(3, 2);
  data.write_image("0001_c1s1_000009_00.png", image::Image(1, 8));
  EXPECT_THAT(message_of(of(data.path())),
              HasSubstr("0001_c1s1_000009_00.png: is 1x8 pixels, expected at least 2x2"));
}

TEST(TrainingSet, DistractorsAreNobody) {
  const reid::TemporaryData data;
  data.write_people(2, 2);
  data.write_image("0000_c1s1_000001_00.jpg", image::Image(8, 8));
  data.write_image("0000_c1s1_000002_00.jpg", image::Image(8, 8));
  const TrainingSet set = load_training_set(of(data.path()));
  EXPECT_EQ(set.identities.size(), 2u);
  EXPECT_EQ(set.images.size(), 4u);
}

TEST(TrainingSet, HeldOutPeopleAreNotTrainedOn) {
  const reid::TemporaryData data;
  data.write_people(10, 3);
  TrainingSetOptions options = of(data.path());
  options.holdout_identities = 4;
  options.seed = 1;
  const TrainingSet set = load_training_set(options);
  EXPECT_EQ(set.identities.size(), 6u);
  ASSERT_EQ(set.validation.size(), 1u);
  EXPECT_EQ(set.validation[0].images.size(), 12u);
  EXPECT_EQ(set.validation[0].labels.back(), 3);
  const auto pids = [](const TrainingSet& s) {
    std::vector<int> result;
    for (const auto& identity : s.identities) result.push_back(identity.pid);
    return result;
  };
  EXPECT_EQ(pids(load_training_set(options)), pids(set));
  options.seed = 2;
  EXPECT_NE(pids(load_training_set(options)), pids(set));
  options.holdout_identities = 9;
  EXPECT_THAT(message_of(options), HasSubstr("1 identities to train on, expected at least 2"));
}

TEST(TrainingSet, ValidationFoldersAreThinnedByPeople) {
  const reid::TemporaryData data, people;
  data.write_people(3, 2);
  people.write_people(8, 2, "query");
  people.write_people(8, 3, "bounding_box_test");
  TrainingSetOptions options = of(data.path());
  options.validation_folders = {people.path()};
  TrainingSet set = load_training_set(options);
  ASSERT_EQ(set.validation.size(), 1u);
  EXPECT_EQ(set.validation[0].images.size(), 40u);
  const auto fingerprint = set.fingerprint;
  options.max_validation_images = 20;
  set = load_training_set(options);
  EXPECT_EQ(set.validation[0].images.size(), 20u);
  EXPECT_EQ(set.validation[0].labels,
            (std::vector<int>{0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3}));
  EXPECT_EQ(set.fingerprint, fingerprint);
}

TEST(TrainingSet, TheFingerprintTellsDataApart) {
  const reid::TemporaryData a, b;
  a.write_people(3, 2);
  b.write_people(3, 3);
  EXPECT_NE(load_training_set(of(a.path())).fingerprint,
            load_training_set(of(b.path())).fingerprint);
}

TEST(TrainingSet, OneUnreadableImageInAHundredIsLeftOut) {
  const reid::TemporaryData data;
  data.write_people(25, 4);
  data.write("0001_c9s1_000001_00.jpg", "not an image");
  const TrainingSet set = load_training_set(of(data.path()));
  EXPECT_EQ(set.images.size(), 100u);
  EXPECT_THAT(set.unreadable, ElementsAre(data.path() / "0001_c9s1_000001_00.jpg"));
  data.write("0002_c9s1_000001_00.jpg", "");
  EXPECT_THAT(
      message_of(of(data.path())),
      testing::AllOf(HasSubstr("2 of 102 images cannot be read"), HasSubstr("more than"),
                     HasSubstr("0001_c9s1_000001_00.jpg"), HasSubstr("0002_c9s1_000001_00.jpg")));
}

TEST(TrainingSet, NamesWhatCannotBeTrainedOn) {
  const reid::TemporaryData empty, one, singles, text;
  EXPECT_THAT(message_of(of(empty.path())), HasSubstr("holds no .jpg or .png image"));
  EXPECT_THAT(message_of(of(empty.path() / "no")), HasSubstr("no"));
  one.write_people(1, 5);
  EXPECT_THAT(message_of(of(one.path())), HasSubstr("1 identities to train on"));
  singles.write_people(5, 1);
  EXPECT_THAT(message_of(of(singles.path())), HasSubstr("every identity has one image only"));
  text.write_people(2, 2);
  text.touch("somebody.jpg");
  EXPECT_THAT(message_of(of(text.path())), HasSubstr("somebody.jpg: the name does not say"));
  EXPECT_THAT(message_of({}), HasSubstr("folders is empty"));
  TrainingSetOptions options = of(one.path());
  options.holdout_identities = -1;
  EXPECT_THAT(message_of(options), HasSubstr("holdout_identities is -1"));
}

TEST(ImageFile, ReadsColourAndRefusesDamage) {
  const reid::TemporaryData data;
  image::Image image(3, 2);
  for (std::size_t i = 0; i < image.bgr.size(); ++i)
    image.bgr[i] = static_cast<std::uint8_t>(10 * i);
  data.write_image("a.png", image);
  const image::Image read = media::read_image(data.path() / "a.png");
  EXPECT_EQ(read.width, 3);
  EXPECT_EQ(read.height, 2);
  EXPECT_EQ(read.bgr, image.bgr);
  EXPECT_THROW(media::read_image(data.path() / "b.png"), std::invalid_argument);
  data.write("cut.jpg", std::string("\xFF\xD8\xFF\xE0 and then nothing", 22));
  EXPECT_THROW(media::read_image(data.path() / "cut.jpg"), std::invalid_argument);
}

TEST(ImageFile, ATruncatedJpegIsNotHalfGrey) {
  const auto source = std::filesystem::path(SDMT_DATA_DIR) / "cuhk03/query/0006_c1s1_000000_00.jpg";
  if (!std::filesystem::exists(source)) GTEST_SKIP() << source << " is not there";
  std::ifstream file(source, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const reid::TemporaryData data;
  data.write("whole.jpg", bytes);
  data.write("cut.jpg", bytes.substr(0, bytes.size() / 2));
  EXPECT_EQ(media::read_image(data.path() / "whole.jpg").width, 64);
  EXPECT_THROW(media::read_image(data.path() / "cut.jpg"), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::train
