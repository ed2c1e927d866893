// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/scene_crops.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "sdmt/io/checked_value.h"
#include "sdmt/reid/labelled_embeddings.h"

namespace sdmt::train {

namespace {

using Indices = std::vector<std::size_t>;

double overlap(const image::PixelRect& a, const image::PixelRect& b) {
  const double width = std::min(a.left + a.width, b.left + b.width) - std::max(a.left, b.left);
  const double height = std::min(a.top + a.height, b.top + b.height) - std::max(a.top, b.top);
  return width > 0 && height > 0 ? width * height : 0;
}

// As many of the boxes of a track, which are in order, as gap and most_crops allow.
Indices spread(const Indices& track, std::span<const SceneBox> boxes,
               const SceneCropOptions& options) {
  Indices apart;
  for (const std::size_t box : track) {
    if (apart.empty() || boxes[box].frame - boxes[apart.back()].frame >= options.gap) {
      apart.push_back(box);
    }
  }
  const auto most = static_cast<std::size_t>(options.most_crops);
  if (apart.size() <= most) return apart;
  Indices chosen;
  for (std::size_t i = 0; i < most; ++i) {
    chosen.push_back(apart[i * (apart.size() - 1) / (most - 1)]);
  }
  return chosen;
}

}  // namespace

void SceneCropOptions::validate() const {
  io::require(gap >= 1, "gap", gap, ">= 1");
  io::require(most_crops >= 2, "most_crops", most_crops, ">= 2");
  io::require_in("fewest_crops", fewest_crops, 2, most_crops);
  io::require_in("most_hidden", most_hidden, 0.0, 1.0);
}

Meetings::Meetings(int tracks)
    : tracks_(tracks), met_(static_cast<std::size_t>(tracks) * static_cast<std::size_t>(tracks)) {}

SceneEvidence find_evidence(std::span<const SceneBox> boxes, const SceneCropOptions& options) {
  options.validate();
  std::map<int, Indices> frames;
  for (std::size_t i = 0; i < boxes.size(); ++i) frames[boxes[i].frame].push_back(i);

  std::map<int, Indices> clear;  // by track
  for (const auto& [frame, in_frame] : frames) {
    for (const std::size_t i : in_frame) {
      const image::PixelRect& rect = boxes[i].rect;
      const double most = options.most_hidden * rect.width * rect.height;
      if (std::all_of(in_frame.begin(), in_frame.end(), [&](std::size_t j) {
            return j == i || overlap(rect, boxes[j].rect) <= most;
          })) {
        clear[boxes[i].track].push_back(i);
      }
    }
  }

  SceneEvidence evidence;
  std::map<int, int> number;  // of the tracks that stay
  for (const auto& [track, its_boxes] : clear) {
    const Indices chosen = spread(its_boxes, boxes, options);
    if (static_cast<int>(chosen.size()) < options.fewest_crops) continue;
    const int count = static_cast<int>(number.size());
    number[track] = count;
    evidence.boxes.insert(evidence.boxes.end(), chosen.begin(), chosen.end());
    evidence.tracks.insert(evidence.tracks.end(), chosen.size(), count);
  }

  evidence.met = Meetings(static_cast<int>(number.size()));
  for (const auto& [frame, in_frame] : frames) {
    for (const std::size_t i : in_frame) {
      const auto a = number.find(boxes[i].track);
      if (a == number.end()) continue;
      for (const std::size_t j : in_frame) {
        const auto b = number.find(boxes[j].track);
        if (b == number.end() || overlap(boxes[i].rect, boxes[j].rect) > 0) continue;
        if (a != b) evidence.met.add(a->second, b->second);
      }
    }
  }
  return evidence;
}

void SceneCrops::append(SceneCrops other) {
  const int ours = met.tracks(), theirs = other.met.tracks();
  std::move(other.images.begin(), other.images.end(), std::back_inserter(images));
  for (const int track : other.tracks) tracks.push_back(ours + track);
  Meetings both(ours + theirs);
  for (int a = 0; a < ours; ++a) {
    for (int b = 0; b < a; ++b) {
      if (met(a, b)) both.add(a, b);
    }
  }
  for (int a = 0; a < theirs; ++a) {
    for (int b = 0; b < a; ++b) {
      if (other.met(a, b)) both.add(ours + a, ours + b);
    }
  }
  met = std::move(both);
}

ScenePairs count_pairs(const SceneCrops& crops) {
  ScenePairs pairs;
  for (std::size_t i = 0; i < crops.tracks.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (crops.tracks[i] == crops.tracks[j]) {
        ++pairs.same;
      } else if (crops.met(crops.tracks[i], crops.tracks[j])) {
        ++pairs.different;
      }
    }
  }
  return pairs;
}

reid::Roc scene_roc(const SceneCrops& crops, const nn::Tensor& embeddings) {
  std::vector<float> same;
  std::vector<float> different;
  const int size = embeddings.shape().c;
  for (int i = 0; i < static_cast<int>(crops.tracks.size()); ++i) {
    for (int j = 0; j < i; ++j) {
      const int a = crops.tracks[i], b = crops.tracks[j];
      if (a != b && !crops.met(a, b)) continue;
      (a == b ? same : different)
          .push_back(reid::euclidean_distance(embeddings.image(i), embeddings.image(j), size));
    }
  }
  return reid::Roc(same, different);
}

}  // namespace sdmt::train
