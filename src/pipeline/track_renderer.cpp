// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/track_renderer.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "mat_view.h"
#include "sdmt/track/pixel_rect.h"

namespace sdmt::pipeline {

namespace {

constexpr std::size_t kTrailFrames = 60;
constexpr double kFont = 0.45;

// OpenCV draws with 32-bit coordinates; boxes may lie anywhere.
int pixel(double value) {
  constexpr double kLimit = 20000;
  return static_cast<int>(std::lround(std::clamp(value, -kLimit, kLimit)));
}

cv::Point point(const cv::Point2d& p) { return {pixel(p.x), pixel(p.y)}; }
cv::Point point(const std::array<double, 2>& p) { return {pixel(p[0]), pixel(p[1])}; }

void dashed_line(cv::Mat& image, cv::Point2d a, cv::Point2d b, const cv::Scalar& colour,
                 double dash, double gap) {
  const cv::Point2d clipped_a(pixel(a.x), pixel(a.y));
  const cv::Point2d clipped_b(pixel(b.x), pixel(b.y));
  const double length = std::hypot(clipped_b.x - clipped_a.x, clipped_b.y - clipped_a.y);
  if (length <= 0) return;
  const cv::Point2d step = (clipped_b - clipped_a) / length;
  for (double at = 0; at < length; at += dash + gap) {
    const double end = std::min(at + dash, length);
    cv::line(image, point(clipped_a + at * step), point(clipped_a + end * step), colour, 2,
             cv::LINE_AA);
  }
}

// Hues a golden ratio of the circle apart, so that neighbouring ids differ most.
cv::Scalar track_colour(int id) {
  constexpr double kGoldenRatio = 0.61803398874989485;
  double whole = 0;
  const double hue = 6 * std::modf(id * kGoldenRatio, &whole);
  const double value = id % 2 == 0 ? 255 : 225;
  const double saturation = id % 3 == 0 ? 0.62 : 0.85;
  const auto channel = [&](double offset) {
    double k = std::fmod(offset + hue, 6.0);
    return value * (1 - saturation * std::clamp(std::min(k, 4 - k), 0.0, 1.0));
  };
  return {channel(1), channel(3), channel(5)};
}

void draw_box(cv::Mat& image, const track::TrackedBox& tracked, const cv::Scalar& colour) {
  const image::PixelRect rect = track::to_pixel_rect(tracked.box);
  const cv::Point2d from(rect.left, rect.top);
  const cv::Point2d to(rect.left + rect.width, rect.top + rect.height);
  if (tracked.source == track::BoxSource::detected) {
    cv::rectangle(image, point(from), point(to), colour, 2, cv::LINE_AA);
    return;
  }
  const bool boosted = tracked.source == track::BoxSource::boosted;
  const double dash = boosted ? 9 : 2;
  const double gap = boosted ? 6 : 5;
  const std::array<cv::Point2d, 4> corners{from, {to.x, from.y}, to, cv::Point2d(from.x, to.y)};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    dashed_line(image, corners[i], corners[(i + 1) % corners.size()], colour, dash, gap);
  }
}

void draw_label(cv::Mat& image, const track::TrackedBox& tracked, const cv::Scalar& colour) {
  const std::string text = std::to_string(tracked.id);
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_DUPLEX, kFont, 1, &baseline);
  const image::PixelRect rect = track::to_pixel_rect(tracked.box);
  const int left = pixel(rect.left - 1);
  // Above the box, or inside where there is no room above.
  int top = pixel(rect.top) - size.height - 6;
  if (top < 0) top = std::max(0, pixel(rect.top));
  const cv::Rect tag(left, top, size.width + 6, size.height + 6);
  cv::rectangle(image, tag, colour, cv::FILLED);
  const double light = 0.114 * colour[0] + 0.587 * colour[1] + 0.299 * colour[2];
  const cv::Scalar ink = light > 140 ? cv::Scalar(0, 0, 0) : cv::Scalar(255, 255, 255);
  cv::putText(image, text, {left + 3, top + size.height + 2}, cv::FONT_HERSHEY_DUPLEX, kFont, ink,
              1, cv::LINE_AA);
}

void draw_trail(cv::Mat& image, const std::deque<std::array<double, 2>>& feet,
                const cv::Scalar& colour) {
  for (std::size_t i = 1; i < feet.size(); ++i) {
    // Older pieces are thinner.
    const int thickness = i + 20 > feet.size() ? 2 : 1;
    cv::line(image, point(feet[i - 1]), point(feet[i]), colour, thickness, cv::LINE_AA);
  }
}

}  // namespace

void TrackRenderer::skip(const track::FinishedFrame& frame) {
  for (const track::IdMerge& merge : frame.merges) {
    const auto old = trails_.find(merge.from);
    if (old == trails_.end()) continue;
    trails_[merge.to] = old->second;
    trails_.erase(old);
  }
  for (const track::TrackedBox& tracked : frame.boxes) {
    Trail& trail = trails_[tracked.id];
    // A trail that paused would draw a line across the picture.
    if (trail.last_frame + 1 < frame.frame) trail.feet.clear();
    const image::PixelRect rect = track::to_pixel_rect(tracked.box);
    trail.feet.push_back({rect.left + rect.width / 2, rect.top + rect.height});
    if (trail.feet.size() > kTrailFrames) trail.feet.pop_front();
    trail.last_frame = frame.frame;
  }
  std::erase_if(trails_, [&](const auto& entry) { return entry.second.last_frame < frame.frame; });
}

void TrackRenderer::draw(const track::FinishedFrame& frame, image::Image& pixels) {
  skip(frame);
  cv::Mat image = mat_view(pixels);
  for (const auto& [id, trail] : trails_) draw_trail(image, trail.feet, track_colour(id));
  for (const auto& tracked : frame.boxes) draw_box(image, tracked, track_colour(tracked.id));
  for (const auto& tracked : frame.boxes) draw_label(image, tracked, track_colour(tracked.id));
  const std::string caption = fmt::format("frame {}  {} people", frame.frame, frame.boxes.size());
  const cv::Point at(8, image.rows - 10);
  cv::putText(image, caption, at, cv::FONT_HERSHEY_DUPLEX, kFont, {0, 0, 0}, 3, cv::LINE_AA);
  cv::putText(image, caption, at, cv::FONT_HERSHEY_DUPLEX, kFont, {255, 255, 255}, 1, cv::LINE_AA);
}

}  // namespace sdmt::pipeline
