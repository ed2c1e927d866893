// SPDX-License-Identifier: Apache-2.0
#include "sdmt/media/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "cli/run_command.h"

namespace sdmt::media {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using tests::read_file;
using tests::TemporaryFolder;
using tests::write_file;

// Something of every frequency, so that a decoder has work to its last byte.
cv::Mat drawing(int width, int height) {
  cv::Mat image(height, width, CV_8UC3);
  cv::RNG noise(7);
  noise.fill(image, cv::RNG::UNIFORM, 0, 90);
  cv::circle(image, {width / 2, height / 2}, height / 3, {40, 200, 250}, 5);
  cv::line(image, {0, height - 1}, {width - 1, 0}, {250, 100, 30}, 3);
  return image;
}

class ImageFile : public testing::Test {
 protected:
  std::string encoded(const std::string& extension, const std::vector<int>& parameters = {}) {
    std::vector<unsigned char> bytes;
    EXPECT_TRUE(cv::imencode(extension, drawing(160, 120), bytes, parameters));
    return {bytes.begin(), bytes.end()};
  }
  std::string error(const std::string& bytes) {
    const auto path = folder_ / "image";
    write_file(path, bytes);
    try {
      const auto image = read_image(path);
      EXPECT_EQ(image.width, 160);
      EXPECT_EQ(image.height, 120);
      return "none";
    } catch (const std::invalid_argument& refused) {
      EXPECT_THAT(refused.what(), testing::StartsWith(path.string() + ": "));
      return refused.what();
    }
  }
  // Whole it is read, and with something behind its end; cut anywhere it is refused.
  void expect_cuts_are_noticed(const std::string& bytes) {
    EXPECT_EQ(error(bytes), "none");
    EXPECT_EQ(error(bytes + std::string(1000, '\0') + "garbage"), "none");
    for (const double part : {0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.999}) {
      const auto length = static_cast<std::size_t>(part * static_cast<double>(bytes.size()));
      EXPECT_THAT(error(bytes.substr(0, length)), HasSubstr("not a readable image")) << part;
    }
    EXPECT_THAT(error(bytes.substr(0, bytes.size() - 1)), HasSubstr("not a readable image"));
  }

  TemporaryFolder folder_;
};

TEST_F(ImageFile, JpegsCutShortAreRefused) { expect_cuts_are_noticed(encoded(".jpg")); }

TEST_F(ImageFile, ProgressiveJpegsCutShortAreRefused) {
  expect_cuts_are_noticed(encoded(".jpg", {cv::IMWRITE_JPEG_PROGRESSIVE, 1}));
}

TEST_F(ImageFile, JpegsWithRestartMarkersCutShortAreRefused) {
  const auto bytes = encoded(".jpg", {cv::IMWRITE_JPEG_RST_INTERVAL, 3});
  EXPECT_NE(bytes.find("\xFF\xD5"), std::string::npos);
  expect_cuts_are_noticed(bytes);
}

TEST_F(ImageFile, TheEndMarkerOfAThumbnailIsNotTheImages) {
  const std::string whole = encoded(".jpg");
  std::vector<unsigned char> thumbnail;
  cv::imencode(".jpg", drawing(40, 30), thumbnail);
  // As cameras do: a segment of the application (APP1) that holds another whole JPEG.
  const std::size_t length = thumbnail.size() + 2;
  std::string segment{'\xFF', '\xE1', static_cast<char>(length >> 8), static_cast<char>(length)};
  segment.append(thumbnail.begin(), thumbnail.end());
  expect_cuts_are_noticed(whole.substr(0, 2) + segment + whole.substr(2));
}

TEST_F(ImageFile, OtherKindsCutShortAreRefused) {
  for (const std::string extension : {".png", ".bmp", ".ppm", ".tif", ".webp"}) {
    SCOPED_TRACE(extension);
    expect_cuts_are_noticed(encoded(extension));
  }
}

TEST_F(ImageFile, TiffsInOtherFormsCutShortAreRefused) {
  constexpr int kNoCompression = 1;
  expect_cuts_are_noticed(encoded(".tif", {cv::IMWRITE_TIFF_COMPRESSION, kNoCompression}));
}

TEST_F(ImageFile, AChangedPngIsRefused) {
  std::string bytes = encoded(".png");
  bytes[bytes.size() / 2] ^= 0x10;
  EXPECT_THAT(error(bytes), HasSubstr("not a readable image"));
}

TEST_F(ImageFile, WhatIsNoImageIsNamed) {
  EXPECT_THAT(error(""), EndsWith(": not a readable image"));
  EXPECT_THAT(error("no image"), EndsWith(": not a readable image"));
  const auto refusal = [](const std::filesystem::path& path) -> std::string {
    try {
      read_image(path);
    } catch (const std::invalid_argument& refused) {
      return refused.what();
    }
    return "none";
  };
  EXPECT_EQ(refusal(folder_ / "none.jpg"), (folder_ / "none.jpg").string() + ": does not exist");
  std::filesystem::create_directory(folder_ / "d.jpg");
  EXPECT_THAT(refusal(folder_ / "d.jpg"),
              EndsWith("d.jpg: is not a regular file, expected an image"));
  ASSERT_EQ(::mkfifo((folder_ / "f.jpg").c_str(), 0600), 0);  // opening it would never return
  EXPECT_THAT(refusal(folder_ / "f.jpg"), HasSubstr("is not a regular file"));
}

TEST_F(ImageFile, AFailingMediumIsAFailureWhileRunning) {
  // The kernel answers EIO for this file: it is the only one that does so everywhere.
  const std::filesystem::path failing = "/proc/self/mem";
  if (!std::filesystem::is_regular_file(failing)) GTEST_SKIP() << failing << " is not there";
  EXPECT_THROW(read_image(failing), std::runtime_error);
  const std::vector<std::filesystem::path> paths{failing};
  EXPECT_FALSE(read_images(paths)[0].has_value());
}

TEST_F(ImageFile, ManyAreReadInOrderAndBadOnesLeftOut) {
  std::vector<std::filesystem::path> paths;
  for (int i = 0; i < 40; ++i) {
    paths.push_back(folder_ / (std::to_string(i) + ".png"));
    if (i % 5 == 0) std::filesystem::create_directory(paths.back());
    if (i % 5 == 1) write_file(paths.back(), "no image");
    if (i % 5 > 2) {
      ASSERT_TRUE(
          cv::imwrite(paths.back().string(), cv::Mat(i + 1, 7, CV_8UC3, cv::Scalar(i, 0, 0))));
    }
  }
  const auto images = read_images(paths);
  for (int i = 0; i < 40; ++i) {
    const auto& image = images.at(static_cast<std::size_t>(i));
    ASSERT_EQ(image.has_value(), i % 5 > 2) << i;
    if (image) {
      EXPECT_EQ(image->height, i + 1);
      EXPECT_EQ(*image->pixel(3, 0), i);
    }
  }
}

TEST(JpegBytes, ThereAndBack) {
  image::Image image(31, 17);
  for (std::size_t i = 0; i < image.bgr.size(); ++i) image.bgr[i] = i % 3 == 1 ? 200 : 50;
  const auto again = decode_image(encode_jpeg(image, 95));
  ASSERT_EQ(again.width, 31);
  ASSERT_EQ(again.height, 17);
  EXPECT_NEAR(*again.pixel(10, 10), 50, 6);
  EXPECT_NEAR(again.pixel(10, 10)[1], 200, 6);
  EXPECT_THROW(decode_image({}), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::media
