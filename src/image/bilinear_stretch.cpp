// SPDX-License-Identifier: Apache-2.0
#include "bilinear_stretch.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sdmt::image {

namespace {

constexpr int kChannels = 3;
constexpr float kWeightOne = 2048.0F;

}  // namespace

BilinearTap::BilinearTap(int position, float fraction, int count)
    : low(std::clamp(position, 0, count - 1)),
      high(std::clamp(position + 1, 0, count - 1)),
      low_weight(static_cast<std::int16_t>(std::lrint((1.0F - fraction) * kWeightOne))),
      high_weight(static_cast<std::int16_t>(std::lrint(fraction * kWeightOne))) {}

BilinearStretch::BilinearStretch(const std::uint8_t* origin, std::ptrdiff_t stride,
                                 std::vector<BilinearTap> columns, std::array<int, 3> channels)
    : origin_(origin), stride_(stride), columns_(std::move(columns)), channels_(channels) {
  for (BilinearTap& column : columns_) {
    column.low *= kChannels;
    column.high *= kChannels;
  }
  for (auto& row : kept_) row.resize(columns_.size() * kChannels);
}

const std::int16_t* BilinearStretch::stretched(int y) {
  const int slot = y % 2;  // neighbours never share a slot
  std::int16_t* row = kept_[slot].data();
  if (kept_row_[slot] == y) return row;
  kept_row_[slot] = y;
  const std::uint8_t* pixels = origin_ + y * stride_;
  const auto [first, second, third] = channels_;
  for (const BilinearTap& column : columns_) {
    const std::uint8_t* low = pixels + column.low;
    const std::uint8_t* high = pixels + column.high;
    const auto mix = [&](int c) {
      const int value = low[c] * column.low_weight + high[c] * column.high_weight;
      return static_cast<std::int16_t>(value >> 4);
    };
    row[0] = mix(first);
    row[1] = mix(second);
    row[2] = mix(third);
    row += kChannels;
  }
  return kept_[slot].data();
}

void BilinearStretch::row(const BilinearTap& rows, std::span<std::uint8_t> out) {
  const std::int16_t* low = stretched(rows.low);
  const std::int16_t* high = stretched(rows.high);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const int mixed = (low[i] * rows.low_weight >> 16) + (high[i] * rows.high_weight >> 16);
    out[i] = static_cast<std::uint8_t>((mixed + 2) >> 2);
  }
}

}  // namespace sdmt::image
