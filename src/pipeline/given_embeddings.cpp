// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/given_embeddings.h"

#include <algorithm>

#include "sdmt/track/pixel_rect.h"

namespace sdmt::pipeline {

void GivenEmbeddings::set(std::span<const mot::Detection> boxes, std::span<const float> vectors) {
  rects_.clear();
  for (const mot::Detection& box : boxes) rects_.push_back(track::to_pixel_rect(box.box));
  vectors_.assign(vectors.begin(), vectors.end());
  if (!boxes.empty()) dimension_ = static_cast<int>(vectors.size() / boxes.size());
}

void GivenEmbeddings::describe(std::span<const image::Crop> crops, image::DescriptorRows& out) {
  out.reset(crops.size(), dimension_);
  for (std::size_t i = 0; i < crops.size(); ++i) {
    const image::PixelRect& wanted = crops[i].rect;
    const auto found = std::find_if(rects_.begin(), rects_.end(), [&](const auto& rect) {
      return rect.left == wanted.left && rect.top == wanted.top && rect.width == wanted.width &&
             rect.height == wanted.height;
    });
    if (found == rects_.end()) continue;
    const auto vector =
        std::span(vectors_).subspan((found - rects_.begin()) * dimension_, dimension_);
    std::copy(vector.begin(), vector.end(), out.row(i).begin());
    out.valid[i] = 1;
  }
}

}  // namespace sdmt::pipeline
