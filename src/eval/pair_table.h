// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "sdmt/eval/similarities.h"

namespace sdmt::eval {

/// Numbers the pairs (ground-truth id, result id) that ever overlap, in the order in which they
/// first do. They are few beside all pairs, which would not fit into memory for long recordings.
class PairTable {
 public:
  struct Ids {
    int gt_id = 0;
    int result_id = 0;
  };

  explicit PairTable(const SequenceSimilarities& sequence) {
    for (const auto& frame : sequence.frames) {
      for (const auto& overlap : frame.overlaps) {
        const Ids ids{frame.gt_ids[overlap.gt], frame.result_ids[overlap.result]};
        const auto key = static_cast<std::uint64_t>(ids.gt_id) << 32U |
                         static_cast<std::uint64_t>(ids.result_id);
        const auto [entry, is_new] = numbers_.try_emplace(key, pairs_.size());
        if (is_new) pairs_.push_back(ids);
        of_overlap_.push_back(entry->second);
      }
    }
  }

  const std::vector<Ids>& pairs() const { return pairs_; }
  /// The pair of each overlap, all frames one after the other.
  const std::vector<std::size_t>& of_overlap() const { return of_overlap_; }

 private:
  std::unordered_map<std::uint64_t, std::size_t> numbers_;
  std::vector<Ids> pairs_;
  std::vector<std::size_t> of_overlap_;
};

}  // namespace sdmt::eval
