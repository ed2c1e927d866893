// SPDX-License-Identifier: Apache-2.0
#include "sdmt/image/camera_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "sdmt/image/image.h"

namespace sdmt::image {
namespace {

constexpr int kWidth = 320, kHeight = 240;

// A street of waves and a chequered wall, smooth as lenses make it.
double street(double x, double y) {
  const double wall = 40 / (1 + std::exp(-8 * (std::sin(x / 9) * std::sin(y / 7) - 0.3)));
  return 110 + 30 * std::sin(x / 31 + 1) + 25 * std::cos(y / 23) + 20 * std::sin((x + 2 * y) / 17) +
         wall;
}

// What a camera sees after it moved by `motion` since it saw street(x, y) at (x, y).
Image view_after(const CameraMotion& motion, double brightness = 0, int noise_seed = 0) {
  const CameraMotion back = motion.inverse();
  Image image(kWidth, kHeight);
  std::uint32_t state = static_cast<std::uint32_t>(noise_seed) * 2654435761U + 1;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      state = state * 1664525U + 1013904223U;
      const double noise = noise_seed == 0 ? 0 : static_cast<double>(state >> 24) / 64 - 2;
      const double value =
          street(back.a * x - back.b * y + back.tx, back.b * x + back.a * y + back.ty);
      const auto grey =
          static_cast<std::uint8_t>(std::clamp(value + brightness + noise, 0.0, 255.0));
      for (int c = 0; c < 3; ++c)
        image.bgr[3 * (static_cast<std::size_t>(y) * kWidth + x) + c] = grey;
    }
  }
  return image;
}

void paint(Image& image, int left, int top, int width, int height, std::uint8_t grey) {
  for (int y = top; y < top + height; ++y) {
    for (int x = 3 * left; x < 3 * (left + width); ++x) {
      image.bgr[static_cast<std::size_t>(y) * kWidth * 3 + x] =
          static_cast<std::uint8_t>(grey + (y * 7 + x * 3) % 60);
    }
  }
}

double corner_error(const CameraMotion& a, const CameraMotion& b) {
  double largest = 0;
  for (const double x : {0.0, static_cast<double>(kWidth)}) {
    for (const double y : {0.0, static_cast<double>(kHeight)}) {
      largest = std::max(largest, std::hypot((a.a - b.a) * x - (a.b - b.b) * y + a.tx - b.tx,
                                             (a.b - b.b) * x + (a.a - b.a) * y + a.ty - b.ty));
    }
  }
  return largest;
}

TEST(CameraMotion, ComposesAndInverts) {
  const CameraMotion first{1.02, 0.01, 5, -3}, second{0.97, -0.02, -8, 2};
  const CameraMotion both = first.then(second);
  const double x = 100, y = 50;
  const double x1 = 1.02 * x - 0.01 * y + 5, y1 = 0.01 * x + 1.02 * y - 3;
  EXPECT_NEAR(both.a * x - both.b * y + both.tx, 0.97 * x1 + 0.02 * y1 - 8, 1e-9);
  EXPECT_NEAR(both.b * x + both.a * y + both.ty, -0.02 * x1 + 0.97 * y1 + 2, 1e-9);
  EXPECT_LT(corner_error(first.then(first.inverse()), {}), 1e-9);
  EXPECT_TRUE(CameraMotion{}.is_still());
  EXPECT_FALSE(first.is_still());
}

TEST(CameraMotion, PansZoomsAndRollsAreFound) {
  const Image start = view_after({});
  for (const CameraMotion& motion : {CameraMotion{1, 0, 5, -3}, CameraMotion{1, 0, -10, 2},
                                     CameraMotion{1.03, 0, -5, -4}, CameraMotion{0.98, 0.015, 6, 2},
                                     CameraMotion{1, -0.02, 2, 4}, CameraMotion{1, 0, 0, 1.5}}) {
    CameraMotionEstimator estimator;
    EXPECT_TRUE(estimator.next(start.view(), {})->is_still());
    const Image after = view_after(motion, 12, 1);
    const auto found = estimator.next(after.view(), {});
    ASSERT_TRUE(found);
    EXPECT_LT(corner_error(*found, motion), 0.5) << motion.tx << " " << motion.a;
  }
}

TEST(CameraMotion, AStillCameraIsStillToTheLastBitWhateverWalksPast) {
  CameraMotionEstimator estimator;
  for (int frame = 0; frame < 70; ++frame) {
    Image image = view_after({}, 4 * std::sin(frame / 9.0), frame + 1);
    const int left = 4 * frame % 250;
    paint(image, left, 50, 45, 125, 190);
    paint(image, 260 - left, 75, 35, 100, 10);
    const PixelRect people[] = {{left + 0.0, 50, 45, 125}, {260.0 - left, 75, 35, 100}};
    const auto found = estimator.next(image.view(), people);
    ASSERT_TRUE(found) << frame;
    ASSERT_TRUE(found->is_still()) << frame << ": " << found->tx << " " << found->ty;
  }
}

TEST(CameraMotion, ASlowPanIsNotLost) {
  CameraMotionEstimator estimator;
  CameraMotion sum;
  constexpr double kSpeed = 0.1;
  for (int frame = 0; frame <= 60; ++frame) {
    const Image image = view_after({1, 0, kSpeed * frame, 0}, 0, frame + 1);
    const auto found = estimator.next(image.view(), {});
    ASSERT_TRUE(found);
    sum = sum.then(*found);
  }
  EXPECT_NEAR(sum.tx, 60 * kSpeed, 0.2 * 60 * kSpeed);  // and not 0
}

TEST(CameraMotion, SaysWhereThereIsNothingToGoBy) {
  CameraMotionEstimator estimator;
  const Image grey(kWidth, kHeight), small(160, 120);
  EXPECT_TRUE(estimator.next(grey.view(), {}));
  EXPECT_FALSE(estimator.next(grey.view(), {}));
  EXPECT_FALSE(estimator.next(small.view(), {}));
  EXPECT_FALSE(estimator.next(ImageView{}, {}));
  const Image start = view_after({});
  EXPECT_FALSE(estimator.next(start.view(), {}));
  Image other(kWidth, kHeight);  // a cut
  paint(other, 0, 0, kWidth, kHeight, 90);
  EXPECT_FALSE(estimator.next(other.view(), {}));
  for (const int side : {1, 2, 7, 16}) {
    CameraMotionEstimator tiny;
    const Image image(side, side);
    tiny.next(image.view(), {});
    EXPECT_FALSE(tiny.next(image.view(), {})) << side;
  }
}

}  // namespace
}  // namespace sdmt::image
