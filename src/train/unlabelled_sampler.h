// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace sdmt::train {

// Draws batches of `size` images without identities, each once before any comes again (the few that
// do not fill a batch wait for the next order). A batch depends on the seed and its number only.
class UnlabelledSampler {
 public:
  // Throws std::invalid_argument when there are fewer images than `size`, >= 0.
  UnlabelledSampler(std::vector<int> images, int size, std::uint64_t seed);

  std::vector<int> batch(std::int64_t iteration);

 private:
  std::vector<int> images_;
  std::vector<int> order_;  // of epoch_
  std::size_t size_;
  std::uint64_t seed_;
  std::int64_t epoch_ = -1;
};

}  // namespace sdmt::train
