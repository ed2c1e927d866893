// SPDX-License-Identifier: Apache-2.0
#include "sdmt/image/camera_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace sdmt::image {

namespace {

constexpr int kLevels = 3;
constexpr int kWidth = 240;          // of the finest level, about
constexpr int kBorder = 2;           // pixels without points
constexpr float kLeastGradient = 2;  // grey levels a pixel
constexpr std::size_t kMost = 1500;  // points of a level
constexpr std::size_t kFewest = 100;
constexpr double kStill = 0.15;        // pixels of the finest level
constexpr double kLargestShift = 0.3;  // of the width
constexpr double kLargestZoom = 1.2;
constexpr double kFewestInliers = 0.4;  // of the points
constexpr float kWorstFit = 0.6F;       // median error beside the contrast
constexpr int kOldest = 50;             // frames after which the frame to compare with is renewed
constexpr int kParameters = 5;          // zoom, roll, shift, brightness

using Vector = std::array<double, kParameters>;

// Solves the symmetric positive system; false where it is none.
bool solve(std::array<Vector, kParameters>& matrix, Vector& right) {
  for (std::size_t i = 0; i < kParameters; ++i) {
    if (!(matrix[i][i] > 1e-9)) return false;
    for (std::size_t row = i + 1; row < kParameters; ++row) {
      const double factor = matrix[row][i] / matrix[i][i];
      for (std::size_t k = i; k < kParameters; ++k) matrix[row][k] -= factor * matrix[i][k];
      right[row] -= factor * right[i];
    }
  }
  for (std::size_t i = kParameters; i-- > 0;) {
    for (std::size_t k = i + 1; k < kParameters; ++k) right[i] -= matrix[i][k] * right[k];
    right[i] /= matrix[i][i];
  }
  return true;
}

// The same motion where pixels are `factor` times as many along x and y, and counted at their
// centres.
CameraMotion rescaled(const CameraMotion& motion, double factor) {
  // Pixel p of the small picture is around (p + 0.5) factor - 0.5 of the large one.
  const double shift = (factor - 1) / 2;
  CameraMotion out = motion;
  out.tx = factor * motion.tx + shift - (motion.a * shift - motion.b * shift);
  out.ty = factor * motion.ty + shift - (motion.b * shift + motion.a * shift);
  return out;
}

float median(std::vector<float> values) {
  if (values.empty()) return 0;
  const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), half, values.end());
  return *half;
}

float median_distance(std::vector<float> values, float from) {
  for (float& value : values) value = std::abs(value - from);
  return median(std::move(values));
}

double largest_displacement(const CameraMotion& m, double width, double height) {
  double largest = 0;
  for (const double x : {0.0, width}) {
    for (const double y : {0.0, height}) {
      largest =
          std::max(largest, std::hypot(m.a * x - m.b * y + m.tx - x, m.b * x + m.a * y + m.ty - y));
    }
  }
  return largest;
}

}  // namespace

double CameraMotion::scale() const { return std::hypot(a, b); }

CameraMotion CameraMotion::inverse() const {
  const double square = a * a + b * b;
  CameraMotion out{a / square, -b / square, 0, 0};
  out.tx = -(out.a * tx - out.b * ty);
  out.ty = -(out.b * tx + out.a * ty);
  return out;
}

CameraMotion CameraMotion::then(const CameraMotion& next) const {
  return {next.a * a - next.b * b, next.a * b + next.b * a, next.a * tx - next.b * ty + next.tx,
          next.b * tx + next.a * ty + next.ty};
}

// Each small pixel is the mean of some of the pixels that it covers.
void CameraMotionEstimator::shrink(const ImageView& frame, std::vector<Level>& levels) const {
  levels.resize(kLevels);
  Level& finest = levels[0];
  const int step = static_cast<int>(step_);
  finest.width = frame.width / step;
  finest.height = frame.height / step;
  finest.grey.resize(static_cast<std::size_t>(finest.width) * finest.height);
  const int stride = std::max(1, step / 4);
  float* out = finest.grey.data();
  for (int y = 0; y < finest.height; ++y) {
    for (int x = 0; x < finest.width; ++x) {
      int sum = 0, count = 0;
      for (int dy = stride / 2; dy < step; dy += stride) {
        const std::uint8_t* row = frame.data + (y * step + dy) * frame.stride + 3 * (x * step);
        for (int dx = stride / 2; dx < step; dx += stride, ++count) sum += row[3 * dx + 1];
      }
      *out++ = static_cast<float>(sum) / static_cast<float>(count);
    }
  }
  for (int i = 1; i < kLevels; ++i) {
    const Level& fine = levels[i - 1];
    Level& coarse = levels[i];
    coarse.width = fine.width / 2;
    coarse.height = fine.height / 2;
    coarse.grey.resize(static_cast<std::size_t>(coarse.width) * coarse.height);
    for (int y = 0; y < coarse.height; ++y) {
      const float* above = fine.grey.data() + static_cast<std::ptrdiff_t>(2 * y) * fine.width;
      const float* below = above + fine.width;
      for (int x = 0; x < coarse.width; ++x) {
        coarse.grey[y * coarse.width + x] =
            (above[2 * x] + above[2 * x + 1] + below[2 * x] + below[2 * x + 1]) / 4;
      }
    }
  }
}

// Makes the present frame the one to compare with.
void CameraMotionEstimator::remember(std::span<const PixelRect> people) {
  std::swap(now_, before_);
  age_ = 0;
  points_.resize(kLevels);
  double step = step_;
  for (int i = 0; i < kLevels; ++i, step *= 2) {
    const Level& level = before_[i];
    std::vector<std::uint8_t> masked(level.grey.size(), 0);
    for (const PixelRect& rect : people) {
      const auto cell = [step](double v, int most) {
        return static_cast<int>(std::clamp(std::floor(v / step), 0.0, static_cast<double>(most)));
      };
      const int right = cell(rect.left + rect.width + step, level.width);
      const int bottom = cell(rect.top + rect.height + step, level.height);
      for (int y = cell(rect.top - step, level.height); y < bottom; ++y) {
        for (int x = cell(rect.left - step, level.width); x < right; ++x) {
          masked[y * level.width + x] = 1;
        }
      }
    }
    Points& points = points_[i];
    points = {};
    std::size_t found = 0;
    const auto each = [&](auto take) {
      for (int y = kBorder; y < level.height - kBorder; ++y) {
        for (int x = kBorder; x < level.width - kBorder; ++x) {
          const int at = y * level.width + x;
          if (masked[at] != 0) continue;
          const float along_x = (level.grey[at + 1] - level.grey[at - 1]) / 2;
          const float along_y = (level.grey[at + level.width] - level.grey[at - level.width]) / 2;
          if (along_x * along_x + along_y * along_y < kLeastGradient * kLeastGradient) continue;
          take(x, y, level.grey[at], along_x, along_y);
        }
      }
    };
    each([&](int, int, float, float, float) { ++found; });
    const std::size_t every = found / kMost + 1;
    std::size_t index = 0;
    each([&](int x, int y, float grey, float along_x, float along_y) {
      if (index++ % every != 0) return;
      points.x.push_back(static_cast<float>(x));
      points.y.push_back(static_cast<float>(y));
      points.grey.push_back(grey);
      points.along_x.push_back(along_x);
      points.along_y.push_back(along_y);
    });
    points.contrast = median_distance(points.grey, median(points.grey));
  }
}

// Improves `motion`, in pixels of the level; false where it cannot be found.
bool CameraMotionEstimator::align(const Points& points, const Level& level, CameraMotion& motion,
                                  bool finest) {
  constexpr int kSteps = 12;
  const double kEnough = finest ? 0.01 : 0.05;  // pixels that a step no longer changes
  constexpr double kTukey = 4.685 * 1.4826;
  constexpr float kQuietest = 1;  // grey levels, least scale of the errors
  constexpr float kOutside = 1e9F;
  const std::size_t count = points.x.size();
  if (count < kFewest) return false;
  const double middle_x = level.width / 2.0, middle_y = level.height / 2.0;
  double brightness = 0;
  errors_.resize(count);
  for (int iteration = 0; iteration < kSteps; ++iteration) {
    sorted_.clear();
    for (std::size_t i = 0; i < count; ++i) {
      const double x = motion.a * points.x[i] - motion.b * points.y[i] + motion.tx;
      const double y = motion.b * points.x[i] + motion.a * points.y[i] + motion.ty;
      errors_[i] = kOutside;
      if (!(x >= 0 && y >= 0 && x < level.width - 1 && y < level.height - 1)) continue;
      const int column = static_cast<int>(x), row = static_cast<int>(y);
      const auto fx = static_cast<float>(x - column), fy = static_cast<float>(y - row);
      const float* above = level.grey.data() + row * level.width + column;
      const float* below = above + level.width;
      const float there = (1 - fy) * ((1 - fx) * above[0] + fx * above[1]) +
                          fy * ((1 - fx) * below[0] + fx * below[1]);
      errors_[i] = there - points.grey[i] - static_cast<float>(brightness);
      sorted_.push_back(std::abs(errors_[i]));
    }
    if (sorted_.size() < std::max(kFewest, count / 2)) return false;
    const auto half = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
    std::nth_element(sorted_.begin(), half, sorted_.end());
    const double bound = kTukey * std::max(*half, kQuietest);
    std::array<Vector, kParameters> matrix{};
    Vector right{};
    std::size_t inliers = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double ratio = errors_[i] / bound;
      if (std::abs(ratio) >= 1) continue;
      ++inliers;
      const double weight = (1 - ratio * ratio) * (1 - ratio * ratio);
      const double x = points.x[i] - middle_x, y = points.y[i] - middle_y;
      const double gx = points.along_x[i], gy = points.along_y[i];
      const Vector row = {gx * x + gy * y, gy * x - gx * y, gx, gy, 1};
      for (std::size_t j = 0; j < kParameters; ++j) {
        for (std::size_t k = j; k < kParameters; ++k) matrix[j][k] += weight * row[j] * row[k];
        right[j] += weight * row[j] * errors_[i];
      }
    }
    if (finest && *half > std::max(kWorstFit * points.contrast, kQuietest)) return false;
    if (finest && static_cast<double>(inliers) < kFewestInliers * static_cast<double>(count))
      return false;
    for (std::size_t j = 0; j < kParameters; ++j) {
      for (std::size_t k = 0; k < j; ++k) matrix[j][k] = matrix[k][j];
    }
    if (!solve(matrix, right)) return false;
    // The step, about the middle of the picture, taken back before the motion.
    CameraMotion step{1 + right[0], right[1], 0, 0};
    step.tx = right[2] + middle_x - (step.a * middle_x - step.b * middle_y);
    step.ty = right[3] + middle_y - (step.b * middle_x + step.a * middle_y);
    motion = step.inverse().then(motion);
    brightness += right[4];
    if (largest_displacement(step, level.width, level.height) < kEnough) break;
  }
  return true;
}

std::optional<CameraMotion> CameraMotionEstimator::next(const ImageView& frame,
                                                        std::span<const PixelRect> people) {
  if (frame.empty()) return std::nullopt;
  const bool first = before_.empty() || frame.width != width_ || frame.height != height_;
  const bool changed = !before_.empty() && first;
  width_ = frame.width;
  height_ = frame.height;
  step_ = std::max(1, frame.width / kWidth);
  shrink(frame, now_);
  if (first) {
    remember(people);
    if (changed) return std::nullopt;
    return CameraMotion{};
  }
  CameraMotion motion;
  bool found = true;
  for (int i = kLevels; found && i-- > 0;) {
    found = align(points_[i], now_[i], motion, i == 0);
    if (i > 0) motion = rescaled(motion, 2);
  }
  const Level& finest = now_[0];
  const double moved = largest_displacement(motion, finest.width, finest.height);
  found = found && moved < kLargestShift * finest.width && motion.scale() < kLargestZoom &&
          motion.scale() > 1 / kLargestZoom;
  const bool still = found && moved < kStill;
  ++age_;
  if (!still || age_ >= kOldest) remember(people);
  if (!found) return std::nullopt;
  if (still) return CameraMotion{};
  return rescaled(motion, step_);
}

}  // namespace sdmt::image
