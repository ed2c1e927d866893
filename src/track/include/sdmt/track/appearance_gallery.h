// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sdmt/track/tracker_options.h"

namespace sdmt::track {

/// The appearance of a tracklet: feature vectors of past states, at most `capacity` of them used
/// (N of equation 2), however long it lives.
///
/// It keeps up to 2 N states on a grid of its life with steps of 1, 2, 4, ... states, the step
/// doubling when they become too many, and the latest state; N of them, evenly spaced from the
/// first to the latest, are used. As long as no more than 2 N states were added,
/// that is exactly an even choice among all of them.
class AppearanceGallery {
 public:
  explicit AppearanceGallery(int capacity) : capacity_(static_cast<std::size_t>(capacity)) {}

  void add(std::span<const float> feature);
  /// Puts the states of an older part of the same track before these.
  void prepend(const AppearanceGallery& older);

  bool empty() const { return ordinals_.empty(); }
  /// States in use, 0..capacity.
  std::size_t size() const;
  /// The i-th of them, oldest first.
  std::span<const float> state(std::size_t i) const;

  /// Mean or smallest Euclidean distance from the states to `feature`. The gallery must not be
  /// empty.
  double distance(std::span<const float> feature, GalleryDistance how) const;
  /// The same over all pairs of states (equation 5). Neither may be empty.
  double distance(const AppearanceGallery& other, GalleryDistance how) const;

 private:
  friend struct Snapshot;

  void thin();
  std::int64_t cell(std::int64_t ordinal) const { return ordinal / stride_; }

  std::size_t capacity_;
  std::size_t dimension_ = 0;
  std::vector<float> features_;         // [states, dimension]
  std::vector<std::int64_t> ordinals_;  // [states] how many states were added before each
  std::int64_t count_ = 0;              // states ever added
  std::int64_t stride_ = 1;
};

/// Euclidean distance of two vectors of the same length.
double euclidean_distance(std::span<const float> a, std::span<const float> b);

}  // namespace sdmt::track
