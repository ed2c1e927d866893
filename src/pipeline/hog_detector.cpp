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
constexpr double kWidthShare = 0.533;
constexpr double kHeightShare = 0.747;
constexpr double kLift = 0.024;
// What windows have to share to speak of the same person, and to be in each other's way.
constexpr double kGroupIou = 0.5;
constexpr double kSuppressionOverlap = 0.6;
// The score's logit.
constexpr double kMarginWeight = 0.95;
constexpr double kCountWeight = 2.55;
constexpr double kBias = -3.07;

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
  if (min_person_height < 24 || min_person_height > 1000) {
    throw std::invalid_argument(
        fmt::format("min_person_height is {}, expected 24 to 1000 pixels", min_person_height));
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

std::vector<mot::Detection> HogDetector::detect(const Frame& frame) {
  if (!frame.has_image()) return {};
  const cv::HOGDescriptor& hog = descriptor_->hog;
  const double zoom = kPersonHeight / options_.min_person_height;
  cv::Mat image;
  const cv::Size size(static_cast<int>(std::lround(frame.image.width * zoom)),
                      static_cast<int>(std::lround(frame.image.height * zoom)));
  if (size.width < hog.winSize.width || size.height < hog.winSize.height) {
    return {};  // no window fits
  }
  cv::resize(mat_view(frame.image), image, size, 0, 0, cv::INTER_LINEAR);

  std::vector<cv::Rect> windows;
  std::vector<double> margins;
  {
    const OpenCvThreads threads;
    hog.detectMultiScale(image, windows, margins, kLeastMargin, cv::Size(8, 8), cv::Size(16, 16),
                         kScaleStep, 0);
  }
  Responses responses;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const cv::Rect& window = windows[i];
    const mot::Cxcywh person{(window.x + window.width / 2.0) / zoom + 1,
                             (window.y + (0.5 - kLift) * window.height) / zoom + 1,
                             window.width * kWidthShare / zoom,
                             window.height * kHeightShare / zoom};
    responses.push_back({mot::to_tlwh(person), margins[i]});
  }
  return find_people(std::move(responses));
}

}  // namespace sdmt::pipeline
