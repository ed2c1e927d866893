// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "sdmt/nn/process_group.h"

namespace sdmt::train {

// Blocks of images that processes take in turn: block b is for process b % size.
inline constexpr std::int64_t kBlock = 32;

inline bool in_share(std::int64_t item, const nn::ProcessGroup& group) {
  return item / kBlock % group.size() == group.rank();
}

// Goes through `total` items in rounds of a block for each process. Each round calls work(first,
// end) for the items of this process, of which the last round may leave none, then share(bounds):
// process r has items [bounds[r], bounds[r + 1]).
template <class Work, class Share>
void for_shared_blocks(std::int64_t total, const nn::ProcessGroup& group, const Work& work,
                       const Share& share) {
  std::vector<std::int64_t> bounds(static_cast<std::size_t>(group.size()) + 1);
  for (std::int64_t round = 0; round < total; round += kBlock * group.size()) {
    for (int rank = 0; rank <= group.size(); ++rank) {
      bounds[rank] = std::min(total, round + rank * kBlock);
    }
    work(bounds[group.rank()], bounds[group.rank() + 1]);
    share(bounds);
  }
}

// bounds of items as those of their bytes, counted from the first.
inline std::vector<std::size_t> byte_bounds(const std::vector<std::int64_t>& bounds,
                                            std::size_t bytes) {
  std::vector<std::size_t> result;
  for (const std::int64_t bound : bounds) {
    result.push_back(static_cast<std::size_t>(bound - bounds.front()) * bytes);
  }
  return result;
}

}  // namespace sdmt::train
