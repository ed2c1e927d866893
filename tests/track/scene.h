// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "sdmt/image/image_view.h"
#include "sdmt/mot/detection.h"
#include "sdmt/track/appearance_model.h"

namespace sdmt::track::test {

/// A person that is really there.
struct Person {
  mot::Tlwh box;
  int look = 0;  ///< 0..14: people with the same look cannot be told apart
};

/// Appearance without images: a box looks like the person it overlaps most, the less the worse it
/// fits, and like background elsewhere. Tests set `people` before each frame.
class FakeAppearance final : public AppearanceModel {
 public:
  static constexpr int kDimension = 16;

  int dimension() const override { return kDimension; }
  double affinity_threshold() const override { return threshold; }
  void embed(const image::ImageView& frame, std::span<const mot::Tlwh> boxes,
             Embeddings& out) override {
    out.dimension = kDimension;
    out.values.assign(boxes.size() * kDimension, 0.0F);
    out.valid.assign(boxes.size(), 1);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const Person* best = nullptr;
      for (const Person& person : people) {
        if (best == nullptr || mot::iou(boxes[i], person.box) > mot::iou(boxes[i], best->box))
          best = &person;
      }
      const double fit = best == nullptr ? 0 : mot::iou(boxes[i], best->box);
      // An angle away from the person's own direction towards the background's.
      const double angle = (1 - fit) * 1.5;
      float* row = out.values.data() + i * kDimension;
      if (best != nullptr) row[best->look] = static_cast<float>(std::cos(angle));
      row[kDimension - 1] = static_cast<float>(std::sin(angle));
      const bool visible = boxes[i].left + boxes[i].width > 1 && boxes[i].left < frame.width + 1;
      if (!visible) out.valid[i] = 0;
      ++embedded;
    }
    ++calls;
  }

  void embed_shifted(const image::ImageView& frame, const mot::Tlwh& box,
                     std::span<const BoxShift> shifts, Embeddings& out) override {
    AppearanceModel::embed_shifted(frame, box, shifts, out);
    ++passes;
  }

  std::vector<Person> people;
  double threshold = 0.6;
  int passes = 0;  ///< of embed_shifted()
  int calls = 0;
  int embedded = 0;
};

/// A view that is never looked into.
inline image::ImageView blank(int width = 2000, int height = 1000) {
  static const std::uint8_t pixel[3] = {};
  return {pixel, width, height, 3 * width, image::ChannelOrder::bgr};
}

inline std::vector<mot::Detection> detect(const std::vector<Person>& people, double score = 0.9) {
  std::vector<mot::Detection> detections;
  for (const Person& person : people) detections.push_back({person.box, score});
  return detections;
}

}  // namespace sdmt::track::test
