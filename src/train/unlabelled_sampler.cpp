// SPDX-License-Identifier: Apache-2.0
#include "unlabelled_sampler.h"

#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "random_stream.h"

namespace sdmt::train {

UnlabelledSampler::UnlabelledSampler(std::vector<int> images, int size, std::uint64_t seed)
    : images_(std::move(images)), size_(static_cast<std::size_t>(size)), seed_(seed) {
  if (size_ <= images_.size()) return;
  throw std::invalid_argument("unlabelled_batch is " + std::to_string(size_) + ", but there are " +
                              std::to_string(images_.size()) + " images without identities");
}

std::vector<int> UnlabelledSampler::batch(std::int64_t iteration) {
  if (size_ == 0) return {};
  const auto batches = static_cast<std::int64_t>(images_.size() / size_);
  if (iteration / batches != epoch_) {
    epoch_ = iteration / batches;
    order_ = images_;
    random_stream(seed_, Purpose::unlabelled, 0, static_cast<std::uint64_t>(epoch_))
        .shuffle(std::span<int>(order_));
  }
  const auto first = order_.begin() + iteration % batches * static_cast<std::ptrdiff_t>(size_);
  return {first, first + static_cast<std::ptrdiff_t>(size_)};
}

}  // namespace sdmt::train
