// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/people_blur.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "mat_view.h"

namespace sdmt::pipeline {

namespace {

constexpr double kMargin = 0.1;  // of the box, on each side
constexpr double kTiles = 8;     // across it

// From the first pixel of the box, which is 1 in MOT's coordinates.
cv::Rect around(const mot::Tlwh& box, const cv::Size& size) {
  const auto within = [](double value, int limit) {
    return static_cast<int>(std::lround(std::clamp(value, 0., static_cast<double>(limit))));
  };
  const int left = within(std::floor(box.left - 1 - kMargin * box.width), size.width);
  const int top = within(std::floor(box.top - 1 - kMargin * box.height), size.height);
  const int right = within(std::ceil(box.left - 1 + (1 + kMargin) * box.width), size.width);
  const int bottom = within(std::ceil(box.top - 1 + (1 + kMargin) * box.height), size.height);
  return {left, top, right - left, bottom - top};
}

}  // namespace

void blur_people(const track::FinishedFrame& frame, image::Image& image) {
  cv::Mat picture = mat_view(image);
  for (const track::TrackedBox& person : frame.boxes) {
    const cv::Rect rect = around(person.box, picture.size());
    if (rect.empty()) continue;
    const double tile = std::max(1., person.box.width / kTiles);
    const cv::Size tiles(std::max(1, static_cast<int>(rect.width / tile)),
                         std::max(1, static_cast<int>(rect.height / tile)));
    cv::Mat small;
    cv::Mat part = picture(rect);
    cv::resize(part, small, tiles, 0, 0, cv::INTER_AREA);
    cv::resize(small, part, rect.size(), 0, 0, cv::INTER_NEAREST);
  }
}

}  // namespace sdmt::pipeline
