// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/given_embeddings.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "sdmt/track/pixel_rect.h"

namespace sdmt::track {

void GivenEmbeddings::set(std::span<const mot::Detection> boxes, std::span<const float> vectors) {
  const auto dimension = boxes.empty() ? 0 : vectors.size() / boxes.size();
  const auto known = static_cast<std::size_t>(dimension_);
  if (dimension * boxes.size() != vectors.size() || (!boxes.empty() && dimension == 0) ||
      (!boxes.empty() && known != 0 && dimension != known)) {
    throw std::invalid_argument("embeddings: " + std::to_string(vectors.size()) + " values for " +
                                std::to_string(boxes.size()) + " boxes, expected " +
                                (known != 0 ? std::to_string(known) : "as many for") + " each");
  }
  rects_.clear();
  for (const mot::Detection& box : boxes) rects_.push_back(to_pixel_rect(box.box));
  vectors_.assign(vectors.begin(), vectors.end());
  if (!boxes.empty()) dimension_ = static_cast<int>(dimension);
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

void scale_to_unit_rows(std::span<float> vectors, std::size_t rows) {
  const std::size_t size = rows == 0 ? 0 : vectors.size() / rows;
  for (std::size_t i = 0; i < rows; ++i) {
    const auto row = vectors.subspan(i * size, size);
    double square = 0;
    for (const float value : row) square += static_cast<double>(value) * value;
    if (!(square > 0) || !std::isfinite(square)) {
      throw std::invalid_argument("embeddings: vector " + std::to_string(i) + " has length " +
                                  std::to_string(std::sqrt(square)) +
                                  ", expected a finite one above 0");
    }
    const double length = std::sqrt(square);
    for (float& value : row) value = static_cast<float>(value / length);
  }
}

}  // namespace sdmt::track
