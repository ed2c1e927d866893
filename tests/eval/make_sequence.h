// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "sdmt/eval/similarities.h"

namespace sdmt::eval {

/// A frame by its ids and the similarities of pairs of ids.
struct IdPair {
  int gt_id;
  int result_id;
  double similarity;
};
inline FrameSimilarities make_frame(std::vector<int> gt_ids, std::vector<int> result_ids,
                                    const std::vector<IdPair>& pairs) {
  FrameSimilarities frame{std::move(gt_ids), std::move(result_ids), {}};
  const auto position = [](const std::vector<int>& ids, int id) {
    return static_cast<int>(std::find(ids.begin(), ids.end(), id) - ids.begin());
  };
  for (const auto& pair : pairs) {
    frame.overlaps.push_back({position(frame.gt_ids, pair.gt_id),
                              position(frame.result_ids, pair.result_id), pair.similarity});
  }
  std::sort(frame.overlaps.begin(), frame.overlaps.end(), [](const BoxPair& a, const BoxPair& b) {
    return a.gt != b.gt ? a.gt < b.gt : a.result < b.result;
  });
  return frame;
}

/// Ids are 0, 1, ... as the metrics want them.
inline SequenceSimilarities make_sequence(std::vector<FrameSimilarities> frames) {
  SequenceSimilarities sequence;
  sequence.frames = std::move(frames);
  for (const auto& frame : sequence.frames) {
    for (const int id : frame.gt_ids) sequence.num_gt_ids = std::max(sequence.num_gt_ids, id + 1);
    for (const int id : frame.result_ids) {
      sequence.num_result_ids = std::max(sequence.num_result_ids, id + 1);
    }
  }
  return sequence;
}

}  // namespace sdmt::eval
