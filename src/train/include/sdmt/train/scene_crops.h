// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sdmt/image/image.h"
#include "sdmt/image/patch.h"
#include "sdmt/nn/tensor.h"
#include "sdmt/reid/roc.h"

namespace sdmt::train {

/// A box that a tracker found in a frame of a scene.
struct SceneBox {
  int frame = 0;
  int track = 0;
  image::PixelRect rect;
};

struct SceneCropOptions {
  int gap = 10;              ///< frames between two crops of a track, >= 1
  int most_crops = 48;       ///< of a track, spread over its time, >= 2
  int fewest_crops = 6;      ///< a track with fewer is left out, 2 to most_crops
  double most_hidden = 0.4;  ///< share of a crop that another box may cover, 0 to 1

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// Which tracks, counted from 0, have been seen in one frame, apart from one another: two people.
/// Tracks that have not met may be one person, and are no evidence.
class Meetings {
 public:
  Meetings() = default;
  explicit Meetings(int tracks);

  int tracks() const { return tracks_; }
  bool operator()(int a, int b) const { return met_[index(a, b)] != 0; }
  void add(int a, int b) { met_[index(a, b)] = met_[index(b, a)] = 1; }

 private:
  std::size_t index(int a, int b) const {
    return static_cast<std::size_t>(a) * static_cast<std::size_t>(tracks_) +
           static_cast<std::size_t>(b);
  }
  int tracks_ = 0;
  std::vector<unsigned char> met_;
};

/// What the tracks of a scene say of who is who, without anybody's labels: the boxes of a track
/// show one person, tracks that have met are two.
struct SceneEvidence {
  std::vector<std::size_t> boxes;  ///< those worth a crop, as indices, by track and then by frame
  std::vector<int> tracks;         ///< of each of them
  Meetings met;
};

/// Takes boxes in any order, at most one of a track in a frame. Of a track it takes boxes of which
/// no other of the frame covers more than most_hidden, as evenly over their time as gap and
/// most_crops allow. Two tracks have met when a frame has boxes of both that do not touch. Throws
/// as the options do.
SceneEvidence find_evidence(std::span<const SceneBox> boxes, const SceneCropOptions& options);

/// Crops of people and what is known of who is who among them.
struct SceneCrops {
  std::vector<image::Image> images;
  std::vector<int> tracks;  ///< of each image
  Meetings met;

  /// Adds those of another scene, none of whose tracks have met ours.
  void append(SceneCrops other);
};

/// How many pairs of crops show one person, and how many two.
struct ScenePairs {
  std::size_t same = 0;
  std::size_t different = 0;
};
ScenePairs count_pairs(const SceneCrops& crops);

/// The curve over these pairs, given the crops' embeddings [images, 1, 1, d]. Throws as reid::Roc.
reid::Roc scene_roc(const SceneCrops& crops, const nn::Tensor& embeddings);

}  // namespace sdmt::train
