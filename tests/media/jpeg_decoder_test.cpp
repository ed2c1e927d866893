// SPDX-License-Identifier: Apache-2.0
// JPEGs that are decoded without OpenCV's codecs, compared with what OpenCV makes of them.
#include "jpeg_decoder.h"

#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "sdmt/media/image_file.h"

namespace sdmt::media {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes jpeg(int width, int height, const std::vector<int>& settings, int type = CV_8UC3) {
  cv::Mat picture(height, width, type);
  cv::RNG(width + 1000 * height).fill(picture, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(picture, picture, {5, 5}, 2);
  Bytes bytes;
  EXPECT_TRUE(cv::imencode(".jpg", picture, bytes, settings));
  return bytes;
}

void expect_as_opencv(const image::Image& image, const Bytes& bytes) {
  const cv::Mat expected = cv::imdecode(bytes, cv::IMREAD_COLOR);
  ASSERT_EQ(image.width, expected.cols);
  ASSERT_EQ(image.height, expected.rows);
  ASSERT_EQ(std::memcmp(image.bgr.data(), expected.data, image.bgr.size()), 0);
}

void expect_plain_and_as_opencv(const Bytes& bytes) {
  const auto image = decode_plain_jpeg(bytes);
  ASSERT_TRUE(image.has_value());
  expect_as_opencv(*image, bytes);
}

// It is read all the same, by OpenCV.
void expect_not_plain(const Bytes& bytes) {
  EXPECT_FALSE(decode_plain_jpeg(bytes).has_value());
  expect_as_opencv(decode_image(bytes), bytes);
}

// A segment of the application (APP1) after the start of the image.
Bytes with_segment(const Bytes& bytes, const Bytes& content) {
  const std::size_t length = content.size() + 2;
  Bytes whole{bytes[0],
              bytes[1],
              0xFF,
              0xE1,
              static_cast<std::uint8_t>(length >> 8),
              static_cast<std::uint8_t>(length)};
  whole.insert(whole.end(), content.begin(), content.end());
  whole.insert(whole.end(), bytes.begin() + 2, bytes.end());
  return whole;
}

TEST(PlainJpeg, OfEverySizeQualityAndOrderHasTheValuesOfOpenCv) {
  for (const int width : {1, 7, 8, 17, 64, 161}) {
    for (const int height : {1, 9, 16, 121}) {
      for (const int quality : {5, 60, 95, 100}) {
        SCOPED_TRACE(testing::Message() << width << " x " << height << ", " << quality);
        expect_plain_and_as_opencv(jpeg(width, height, {cv::IMWRITE_JPEG_QUALITY, quality}));
      }
      expect_plain_and_as_opencv(jpeg(width, height, {cv::IMWRITE_JPEG_PROGRESSIVE, 1}));
      expect_plain_and_as_opencv(jpeg(width, height, {cv::IMWRITE_JPEG_RST_INTERVAL, 2}));
      expect_plain_and_as_opencv(jpeg(width, height, {cv::IMWRITE_JPEG_OPTIMIZE, 1}, CV_8UC1));
    }
  }
}

TEST(PlainJpeg, OfEverySubsamplingHasTheValuesOfOpenCv) {
  const image::Image picture = decode_image(jpeg(75, 53, {cv::IMWRITE_JPEG_QUALITY, 100}));
  const tjhandle encoder = tjInitCompress();
  for (const int kind : {TJSAMP_444, TJSAMP_422, TJSAMP_420, TJSAMP_GRAY, TJSAMP_440, TJSAMP_411}) {
    SCOPED_TRACE(kind);
    unsigned char* made = nullptr;
    unsigned long size = 0;
    EXPECT_EQ(tjCompress2(encoder, picture.pixel(0, 0), 75, 3 * 75, 53, TJPF_BGR, &made, &size,
                          kind, 90, 0),
              0);
    expect_plain_and_as_opencv(Bytes(made, made + size));
    tjFree(made);
  }
  tjDestroy(encoder);
}

TEST(PlainJpeg, LeavesOthersToOpenCv) {
  const Bytes plain = jpeg(33, 21, {});
  // TIFF header, one entry: orientation (0x112, a short) 6, a quarter turn.
  Bytes exif{'E', 'x', 'i', 'f', 0, 0, 'M', 'M', 0, 42, 0, 0, 0, 8, 0, 1};
  exif.insert(exif.end(), {0x01, 0x12, 0, 3, 0, 0, 0, 1, 0, 6, 0, 0, 0, 0, 0, 0});
  const Bytes turned = with_segment(plain, exif);
  expect_not_plain(turned);
  EXPECT_EQ(decode_image(turned).width, 21);
  expect_plain_and_as_opencv(with_segment(plain, {'h', 't', 't', 'p'}));

  Bytes changed = plain;  // more data than there are blocks: a warning of the decoder
  changed.insert(changed.end() - 2, {0x12, 0x34, 0x56, 0x78, 0x12, 0x34, 0x56, 0x78});
  expect_not_plain(changed);

  Bytes png;
  ASSERT_TRUE(cv::imencode(".png", cv::Mat(5, 6, CV_8UC3, cv::Scalar(1, 2, 3)), png));
  expect_not_plain(png);
}

TEST(PlainJpeg, IsNothingForDamagedBytes) {
  const Bytes whole = jpeg(40, 30, {});
  for (std::size_t length = 0; length + 2 < whole.size(); length += 7) {
    EXPECT_FALSE(decode_plain_jpeg(std::span(whole).first(length)).has_value()) << length;
  }
  for (std::size_t at = 2; at < whole.size(); ++at) {  // may still decode, but as OpenCV would
    Bytes changed = whole;
    changed[at] ^= 0x55;
    const auto image = decode_plain_jpeg(changed);
    if (!image) continue;
    SCOPED_TRACE(at);
    ASSERT_NO_FATAL_FAILURE(expect_as_opencv(*image, changed));
  }
}

}  // namespace
}  // namespace sdmt::media
