// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdmt/image/crop_descriptor.h"
#include "sdmt/mot/detection.h"

namespace sdmt::track::test {

/// A person that is really there.
struct Person {
  mot::Tlwh box;
  int look = 0;  ///< 0..14: people with the same look cannot be told apart
};

/// Appearance without images: a box looks like the person it overlaps most, the less the worse it
/// fits, and like background elsewhere. Tests set `people` before each frame.
class FakeDescriptor final : public image::CropDescriptor {
 public:
  static constexpr int kDimension = 16;

  std::string name() const override { return "fake"; }
  int dimension() const override { return kDimension; }
  std::optional<double> tau_a() const override { return threshold; }
  void describe(std::span<const image::Crop> crops, image::DescriptorRows& out) override {
    out.reset(crops.size(), kDimension);
    for (std::size_t i = 0; i < crops.size(); ++i) {
      const image::PixelRect& rect = crops[i].rect;
      const mot::Tlwh box{rect.left + 1, rect.top + 1, rect.width, rect.height};
      const Person* best = nullptr;
      for (const Person& person : people) {
        if (best == nullptr || mot::iou(box, person.box) > mot::iou(box, best->box)) best = &person;
      }
      const double fit = best == nullptr ? 0 : mot::iou(box, best->box);
      // An angle away from the person's own direction towards the background's.
      const double angle = (1 - fit) * 1.5;
      float* row = out.values.data() + i * kDimension;
      if (best != nullptr) row[best->look] = static_cast<float>(std::cos(angle));
      row[kDimension - 1] = static_cast<float>(std::sin(angle));
      out.valid[i] = rect.left + rect.width > 0 && rect.left < crops[i].image.width ? 1 : 0;
      ++embedded;
    }
    ++calls;
  }

  void describe_shifted(const image::ImageView& image, const image::PixelRect& window,
                        std::span<const image::GridShift> shifts,
                        image::DescriptorRows& out) override {
    CropDescriptor::describe_shifted(image, window, shifts, out);
    ++passes;
  }

  std::vector<Person> people;
  std::optional<double> threshold = 0.6;
  int passes = 0;  ///< of describe_shifted()
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
