// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/camera_means.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

#include "reid/reid_fixture.h"
#include "sdmt/reid/pair_curve.h"

namespace sdmt::reid {
namespace {

using testing::ElementsAre;
using testing::FloatNear;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(CameraMeans, ByHand) {
  auto images = labelled({{1, 0}, {0.6F, 0.8F}, {0, 1}, {0.6F, 0.8F}}, {1, 1, 2, 2}, {7, 3, 7, 3});
  subtract_camera_means(images.embeddings, images.camids);
  const float half = std::sqrt(0.5F);
  // Camera 7 has the mean (0.5, 0.5); by camera 3 all are alike, and nothing is left.
  EXPECT_THAT(images.embeddings.values(),
              ElementsAre(FloatNear(half, 1e-6F), FloatNear(-half, 1e-6F), 0, 0,
                          FloatNear(-half, 1e-6F), FloatNear(half, 1e-6F), 0, 0));
}

// People as random directions, seen by each camera with a light of its own.
TEST(CameraMeans, TellsPeopleApartWhoseCamerasDiffer) {
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  constexpr int kPeople = 60, kSize = 16;
  std::vector<std::vector<float>> rows;
  std::vector<int> pids, camids;
  std::vector<float> light[2];
  for (auto& one : light) {
    for (int k = 0; k < kSize; ++k) one.push_back(2 * normal(random));
  }
  for (int person = 0; person < kPeople; ++person) {
    std::vector<float> looks;
    for (int k = 0; k < kSize; ++k) looks.push_back(normal(random));
    for (int camera = 0; camera < 2; ++camera) {
      std::vector<float> row;
      float square = 0;
      for (int k = 0; k < kSize; ++k) {
        row.push_back(looks[k] + light[camera][k] + 0.3F * normal(random));
        square += row.back() * row.back();
      }
      for (float& value : row) value /= std::sqrt(square);
      rows.push_back(row);
      pids.push_back(person + 1);
      camids.push_back(camera + 1);
    }
  }
  auto images = labelled(rows, pids, camids);
  PairOptions all;
  const double before = pair_curve(images, all).roc.auc();
  subtract_camera_means(images.embeddings, images.camids);
  EXPECT_LT(before, 0.8);
  EXPECT_GT(pair_curve(images, all).roc.auc(), 0.97);
}

TEST(CameraMeans, NeedMoreThanOneImageOfACamera) {
  auto images = labelled({{1, 0}, {0, 1}, {0, 1}}, {1, 2, 3}, {4, 4, 9});
  EXPECT_THAT([&] { subtract_camera_means(images.embeddings, images.camids); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("camera 9 has 1 image")));
  images.camids.pop_back();
  EXPECT_THAT([&] { subtract_camera_means(images.embeddings, images.camids); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("3 rows with 2 camids")));
}

}  // namespace
}  // namespace sdmt::reid
