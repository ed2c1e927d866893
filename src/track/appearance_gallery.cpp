// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/appearance_gallery.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace sdmt::track {

double euclidean_distance(std::span<const float> a, std::span<const float> b) {
  // Independent sums in a fixed order: the compiler can use whole vectors, the result is always the
  // same.
  constexpr std::size_t kLanes = 16;
  float sums[kLanes] = {};
  std::size_t i = 0;
  for (; i + kLanes <= a.size(); i += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const float difference = a[i + lane] - b[i + lane];
      sums[lane] += difference * difference;
    }
  }
  double sum = 0;
  for (; i < a.size(); ++i) sum += static_cast<double>(a[i] - b[i]) * (a[i] - b[i]);
  for (const float part : sums) sum += part;
  return std::sqrt(sum);
}

void AppearanceGallery::add(std::span<const float> feature) {
  dimension_ = feature.size();
  const std::int64_t ordinal = count_++;
  // The latest state is kept even off the grid, until the next one comes.
  const std::size_t size = ordinals_.size();
  if (size >= 2 && cell(ordinals_[size - 1]) == cell(ordinals_[size - 2])) {
    ordinals_.pop_back();
    features_.resize(features_.size() - dimension_);
  }
  ordinals_.push_back(ordinal);
  features_.insert(features_.end(), feature.begin(), feature.end());
  thin();
}

void AppearanceGallery::prepend(const AppearanceGallery& older) {
  if (older.count_ == 0) return;
  for (std::int64_t& ordinal : ordinals_) ordinal += older.count_;
  ordinals_.insert(ordinals_.begin(), older.ordinals_.begin(), older.ordinals_.end());
  features_.insert(features_.begin(), older.features_.begin(), older.features_.end());
  count_ += older.count_;
  stride_ = std::max(stride_, older.stride_);
  dimension_ = std::max(dimension_, older.dimension_);
  thin();
}

void AppearanceGallery::thin() {
  while (ordinals_.size() > 2 * capacity_) {
    stride_ *= 2;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < ordinals_.size(); ++i) {
      const bool latest = i + 1 == ordinals_.size();
      if (kept > 0 && cell(ordinals_[i]) == cell(ordinals_[kept - 1]) && !latest) continue;
      if (kept == i) {
        ++kept;
        continue;
      }
      ordinals_[kept] = ordinals_[i];
      std::copy_n(features_.begin() + static_cast<std::ptrdiff_t>(i * dimension_), dimension_,
                  features_.begin() + static_cast<std::ptrdiff_t>(kept * dimension_));
      ++kept;
    }
    ordinals_.resize(kept);
    features_.resize(kept * dimension_);
  }
}

std::size_t AppearanceGallery::size() const { return std::min(ordinals_.size(), capacity_); }

std::span<const float> AppearanceGallery::state(std::size_t i) const {
  const std::size_t used = size();
  // Nearest to i / (used - 1) of the way from the first to the latest; halves go up.
  const std::size_t row = used <= 1
                              ? ordinals_.size() - 1
                              : (2 * i * (ordinals_.size() - 1) + used - 1) / (2 * (used - 1));
  return std::span(features_).subspan(row * dimension_, dimension_);
}

double AppearanceGallery::distance(std::span<const float> feature, GalleryDistance how) const {
  double sum = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < size(); ++i) {
    const double d = euclidean_distance(state(i), feature);
    sum += d;
    nearest = std::min(nearest, d);
  }
  return how == GalleryDistance::mean ? sum / static_cast<double>(size()) : nearest;
}

double AppearanceGallery::distance(const AppearanceGallery& other, GalleryDistance how) const {
  double sum = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < size(); ++i) {
    const double d = other.distance(state(i), how);
    sum += d;
    nearest = std::min(nearest, d);
  }
  return how == GalleryDistance::mean ? sum / static_cast<double>(size()) : nearest;
}

}  // namespace sdmt::track
