// SPDX-License-Identifier: Apache-2.0
#include "tracking/hog_detector.h"

#include <fmt/core.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <tuple>

namespace sdmt::tools {

namespace {

// A person of the training images stands 96 pixels tall in a window of 64 x 128.
constexpr double kPersonHeight = 96;
constexpr double kWidthShare = 0.52;  // of the window that the person's box takes
constexpr double kHeightShare = 0.74;
constexpr double kScaleStep = 1.1;
constexpr double kSuppressionIou = 0.4;
constexpr double kMidpoint = 0.8;
constexpr double kScale = 0.35;

// OpenCV spreads the scales over its own threads, which main() has switched off for the rest.
class OpenCvThreads {
 public:
  explicit OpenCvThreads(int threads) { cv::setNumThreads(threads); }
  ~OpenCvThreads() { cv::setNumThreads(1); }
  OpenCvThreads(const OpenCvThreads&) = delete;
  OpenCvThreads& operator=(const OpenCvThreads&) = delete;
};

std::vector<track::Detection> suppress(std::vector<track::Detection> boxes) {
  // The threads found them in any order; this one is the same on every run.
  std::sort(boxes.begin(), boxes.end(), [](const track::Detection& a, const track::Detection& b) {
    return std::tie(b.score, a.box.left, a.box.top, a.box.height) <
           std::tie(a.score, b.box.left, b.box.top, b.box.height);
  });
  std::vector<track::Detection> kept;
  for (const track::Detection& candidate : boxes) {
    const bool free = std::none_of(kept.begin(), kept.end(), [&](const track::Detection& other) {
      return track::iou(candidate.box, other.box) > kSuppressionIou;
    });
    if (free) kept.push_back(candidate);
  }
  return kept;
}

}  // namespace

void HogOptions::validate() const {
  if (min_person_height < 24 || min_person_height > 1000) {
    throw std::invalid_argument(
        fmt::format("min_person_height is {}, expected 24 to 1000 pixels", min_person_height));
  }
}

HogDetector::HogDetector(const HogOptions& options) : options_(options) {
  options_.validate();
  descriptor_.setSVMDetector(cv::HOGDescriptor::getDefaultPeopleDetector());
}

std::vector<track::Detection> HogDetector::detect(const Frame& frame) {
  if (frame.image.empty()) return {};
  const double zoom = kPersonHeight / options_.min_person_height;
  cv::Mat image;
  const cv::Size size(static_cast<int>(std::lround(frame.image.cols * zoom)),
                      static_cast<int>(std::lround(frame.image.rows * zoom)));
  if (size.width < descriptor_.winSize.width || size.height < descriptor_.winSize.height) {
    return {};  // no window fits
  }
  cv::resize(frame.image, image, size, 0, 0, cv::INTER_LINEAR);

  std::vector<cv::Rect> windows;
  std::vector<double> margins;
  {
    const OpenCvThreads threads(omp_get_max_threads());
    descriptor_.detectMultiScale(image, windows, margins, 0, cv::Size(8, 8), cv::Size(16, 16),
                                 kScaleStep, 0);
  }
  std::vector<track::Detection> boxes;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const double width = windows[i].width * kWidthShare / zoom;
    const double height = windows[i].height * kHeightShare / zoom;
    const double cx = (windows[i].x + windows[i].width / 2.0) / zoom;
    const double cy = (windows[i].y + windows[i].height / 2.0) / zoom;
    const double score = 1 / (1 + std::exp(-(margins[i] - kMidpoint) / kScale));
    boxes.push_back({{cx - width / 2 + 1, cy - height / 2 + 1, width, height}, score});
  }
  return suppress(std::move(boxes));
}

}  // namespace sdmt::tools
