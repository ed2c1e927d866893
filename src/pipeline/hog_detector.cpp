// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/hog_detector.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/objdetect.hpp>
#include <stdexcept>
#include <tuple>

#include "mat_view.h"
#include "opencv_threads.h"

namespace sdmt::pipeline {

namespace {

// A person of the training images stands 96 pixels tall in a window of 64 x 128.
constexpr double kPersonHeight = 96;
constexpr double kScaleStep = 1.2;
constexpr double kLeastMargin = -0.6;
// The person's box: shares of the window, and how far its centre lies above the window's.
constexpr double kWidthShare = 0.546;
constexpr double kHeightShare = 0.750;
constexpr double kLift = 0.015;
// What windows have to share to speak of the same person, and to be in each other's way.
constexpr double kGroupIou = 0.5;
constexpr double kSuppressionOverlap = 0.6;
// People who fill the picture are looked for in one that goes on beyond its borders, by this share
// of its height, with their pixels smeared outwards.
constexpr double kBorder = 0.25;
// Most pixels that are searched; larger pictures are scaled down, unless the smallest person is
// named.
constexpr double kMostPixels = 2.4e6;
// The score's logit.
constexpr double kMarginWeight = 2.15;
constexpr double kCountWeight = 1.05;
constexpr double kBias = -2.71;

struct Response {
  mot::Tlwh box;  // the person's, not the window
  double margin = 0;
};

using Responses = std::vector<Response>;

// What two boxes share of the smaller one.
double overlap_of_smaller(const mot::Tlwh& a, const mot::Tlwh& b) {
  const double iou = mot::iou(a, b);
  const double shared = iou / (1 + iou) * (mot::area(a) + mot::area(b));
  return shared / std::min(mot::area(a), mot::area(b));
}

// The person of whom the strongest response and those around it speak.
mot::Detection merge(const Response& strongest, const Responses& responses) {
  int count = 0;
  double weights = 0;
  double cx = 0;
  double cy = 0;
  double log_height = 0;
  for (const Response& response : responses) {
    if (mot::iou(strongest.box, response.box) <= kGroupIou) continue;
    const auto box = mot::to_cxcywh(response.box);
    const double weight = std::exp(response.margin);
    ++count;
    weights += weight;
    cx += weight * box.cx;
    cy += weight * box.cy;
    log_height += weight * std::log(box.height);
  }
  const double height = std::exp(log_height / weights);
  const double width = height * strongest.box.width / strongest.box.height;
  const double logit = kMarginWeight * strongest.margin + kCountWeight * std::log(count) + kBias;
  return {mot::to_tlwh({cx / weights, cy / weights, width, height}), 1 / (1 + std::exp(-logit))};
}

std::vector<mot::Detection> find_people(Responses responses) {
  // The threads found them in any order; this one is the same on every run.
  std::sort(responses.begin(), responses.end(), [](const Response& a, const Response& b) {
    return std::tie(b.margin, a.box.left, a.box.top, a.box.height) <
           std::tie(a.margin, b.box.left, b.box.top, b.box.height);
  });
  std::vector<mot::Tlwh> taken;
  std::vector<mot::Detection> people;
  for (const Response& response : responses) {
    if (response.margin <= 0) break;
    const bool free = std::none_of(taken.begin(), taken.end(), [&](const mot::Tlwh& box) {
      return overlap_of_smaller(response.box, box) > kSuppressionOverlap;
    });
    if (!free) continue;
    taken.push_back(response.box);
    people.push_back(merge(response, responses));
  }
  return people;
}

}  // namespace

void HogOptions::validate() const {
  if (min_person_height != 0 && (min_person_height < 24 || min_person_height > 1000)) {
    throw std::invalid_argument(fmt::format(
        "min_person_height is {}, expected 24 to 1000 pixels, or 0", min_person_height));
  }
}

struct HogDetector::Descriptor {
  cv::HOGDescriptor hog;
};

HogDetector::HogDetector(const HogOptions& options)
    : options_(options), descriptor_(std::make_unique<Descriptor>()) {
  options_.validate();
  descriptor_->hog.setSVMDetector(cv::HOGDescriptor::getDefaultPeopleDetector());
}

HogDetector::~HogDetector() = default;

namespace {

// Adds the windows that answer in `image`, which shows the frame `zoom` times as large with
// `border` pixels around it.
void search(const cv::HOGDescriptor& hog, const cv::Mat& image, double zoom, int border,
            Responses& responses) {
  std::vector<cv::Rect> windows;
  std::vector<double> margins;
  {
    const OpenCvThreads threads;
    hog.detectMultiScale(image, windows, margins, kLeastMargin, cv::Size(8, 8), cv::Size(16, 16),
                         kScaleStep, 0);
  }
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const cv::Rect& window = windows[i];
    const mot::Cxcywh person{(window.x - border + window.width / 2.0) / zoom + 1,
                             (window.y - border + (0.5 - kLift) * window.height) / zoom + 1,
                             window.width * kWidthShare / zoom,
                             window.height * kHeightShare / zoom};
    responses.push_back({mot::to_tlwh(person), margins[i]});
  }
}

bool fits(const cv::HOGDescriptor& hog, double width, double height) {
  return std::lround(width) >= hog.winSize.width && std::lround(height) >= hog.winSize.height;
}

}  // namespace

std::vector<mot::Detection> HogDetector::detect(const Frame& frame) {
  if (!frame.has_image()) return {};
  const cv::HOGDescriptor& hog = descriptor_->hog;
  const double width = frame.image.width, height = frame.image.height;
  double zoom = kPersonHeight / HogOptions::kSmallest;
  if (options_.min_person_height > 0) {
    zoom = kPersonHeight / options_.min_person_height;
  } else {
    zoom = std::min(zoom, std::sqrt(kMostPixels / (width * height)));
  }
  Responses responses;
  const auto scaled = [&](double factor) {
    cv::Mat image;
    const cv::Size size(std::max(1, static_cast<int>(std::lround(width * factor))),
                        std::max(1, static_cast<int>(std::lround(height * factor))));
    cv::resize(mat_view(frame.image), image, size, 0, 0,
               factor < 0.5 ? cv::INTER_AREA : cv::INTER_LINEAR);
    return image;
  };
  if (fits(hog, width * zoom, height * zoom)) search(hog, scaled(zoom), zoom, 0, responses);
  // OpenCV stops at windows as tall as the picture, of which a person fills three quarters.
  while (fits(hog, width * zoom, height * zoom)) zoom /= kScaleStep;
  const int border = static_cast<int>(std::lround(kBorder * height * zoom));
  cv::Mat wide;
  cv::copyMakeBorder(scaled(zoom), wide, border, border, border, border, cv::BORDER_REPLICATE);
  if (fits(hog, wide.cols, wide.rows)) search(hog, wide, zoom, border, responses);
  return find_people(std::move(responses));
}

}  // namespace sdmt::pipeline
