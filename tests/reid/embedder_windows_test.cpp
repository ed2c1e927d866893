// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "reid/formula_network.h"
#include "sdmt/reid/embedder.h"

namespace sdmt::reid {
namespace {

namespace fs = std::filesystem;

constexpr int kDimension = 128;  // of vgg16's embeddings

class Windows : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const auto path =
        fs::temp_directory_path() / ("sdmt_windows_" + std::to_string(getpid()) + ".safetensors");
    testing_support::write_formula_model(path);
    embedder_ = new Embedder(load_model(path), {.max_batch = 4});
    fs::remove(path);
  }
  static void TearDownTestSuite() {
    delete embedder_;
    embedder_ = nullptr;
  }

  static double squared_distance(const float* a, const float* b) {
    double sum = 0;
    for (int i = 0; i < kDimension; ++i) sum += (a[i] - b[i]) * static_cast<double>(a[i] - b[i]);
    return sum;
  }

  static Embedder* embedder_;
  testing_support::FormulaCrop picture_{15};  // 295 x 155 pixels
  // Cells of 2 x 3 pixels: every shift is a whole number of pixels.
  image::PixelRect window_{60, 90, 32, 96};
};

Embedder* Windows::embedder_ = nullptr;

TEST_F(Windows, OneWindowIsOneCrop) {
  image::DescriptorRows crop, window;
  embedder_->describe(std::vector<image::Crop>{{picture_.view(), window_}}, crop);
  embedder_->describe_shifted(picture_.view(), window_, std::vector<image::GridShift>{{0, 0}},
                              window);
  EXPECT_EQ(window.values, crop.values);
  EXPECT_EQ(window.valid, crop.valid);
  const image::PixelRect moved{window_.left - 8, window_.top + 15, window_.width, window_.height};
  embedder_->describe(std::vector<image::Crop>{{picture_.view(), moved}}, crop);
  embedder_->describe_shifted(picture_.view(), window_, std::vector<image::GridShift>{{-4, 5}},
                              window);
  EXPECT_EQ(window.values, crop.values);
}

// What a window sees beyond its edges sets it apart from the crop, but no other crop is closer.
TEST_F(Windows, EveryWindowIsClosestToItsOwnCrop) {
  std::vector<image::GridShift> shifts;
  std::vector<image::Crop> crops;
  for (const int rows : {-8, 0, 7}) {
    for (const int columns : {-6, 1, 5}) {
      shifts.push_back({columns, rows});
      crops.push_back({picture_.view(),
                       {window_.left + 2.0 * columns, window_.top + 3.0 * rows, window_.width,
                        window_.height}});
    }
  }
  image::DescriptorRows expected, got;
  embedder_->describe(crops, expected);
  embedder_->describe_shifted(picture_.view(), window_, shifts, got);
  ASSERT_EQ(got.valid, std::vector<unsigned char>(shifts.size(), 1));
  for (std::size_t i = 0; i < shifts.size(); ++i) {
    const float* row = got.values.data() + i * kDimension;
    for (std::size_t j = 0; j < shifts.size(); ++j) {
      if (j == i) continue;
      EXPECT_LT(squared_distance(row, expected.values.data() + i * kDimension),
                squared_distance(row, expected.values.data() + j * kDimension))
          << i << " and " << j;
    }
  }
}

TEST_F(Windows, NoneIsNoWork) {
  image::DescriptorRows rows;
  embedder_->describe_shifted(picture_.view(), window_, {}, rows);
  EXPECT_TRUE(rows.values.empty() && rows.valid.empty());
}

TEST_F(Windows, MustLieInTheImage) {
  image::DescriptorRows rows;
  for (const image::GridShift shift : {image::GridShift{-31, 0}, {0, -31}, {32, 0}, {0, 37}}) {
    EXPECT_THROW(
        embedder_->describe_shifted(picture_.view(), window_, std::vector{shift, {0, 0}}, rows),
        std::invalid_argument)
        << shift.columns << " " << shift.rows;
  }
}

}  // namespace
}  // namespace sdmt::reid
