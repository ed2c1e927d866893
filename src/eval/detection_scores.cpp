// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/detection_scores.h"

#include <algorithm>
#include <cstdint>

namespace sdmt::eval {

namespace {

constexpr double kMinIou = 0.5;

double share(std::size_t part, std::size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

}  // namespace

void DetectionScorer::add_frame(std::span<const mot::Tlwh> people,
                                std::span<const mot::Tlwh> ignored,
                                std::span<const mot::Detection> detections) {
  people_ += people.size();
  std::vector<mot::Detection> order(detections.begin(), detections.end());
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.score > b.score; });
  std::vector<std::uint8_t> taken(people.size(), 0);
  for (const mot::Detection& detection : order) {
    std::size_t best = people.size();
    double best_iou = kMinIou;
    for (std::size_t i = 0; i < people.size(); ++i) {
      const double iou = mot::iou(detection.box, people[i]);
      if (taken[i] != 0 || iou < best_iou) continue;
      best = i;
      best_iou = iou;
    }
    const bool found = best < people.size();
    if (found) taken[best] = 1;
    const bool passed_over =
        !found && std::any_of(ignored.begin(), ignored.end(), [&](const mot::Tlwh& box) {
          return mot::iou(detection.box, box) >= kMinIou;
        });
    if (!passed_over) boxes_.push_back({detection.score, found});
  }
}

DetectionScores DetectionScorer::scores(double least_score) const {
  std::vector<Box> order = boxes_;
  std::stable_sort(order.begin(), order.end(),
                   [](const Box& a, const Box& b) { return a.score > b.score; });
  DetectionScores scores;
  scores.people = people_;
  std::vector<double> precision;  // after each box
  std::size_t found = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (order[i].found) ++found;
    precision.push_back(share(found, i + 1));
    if (order[i].score >= least_score) {
      scores.boxes = i + 1;
      scores.found = found;
    }
  }
  scores.recall = share(scores.found, people_);
  scores.precision = share(scores.found, scores.boxes);
  double best = 0;
  for (std::size_t i = order.size(); i-- > 0;) {
    best = std::max(best, precision[i]);
    if (order[i].found) scores.average_precision += best * share(1, people_);
  }
  return scores;
}

}  // namespace sdmt::eval
