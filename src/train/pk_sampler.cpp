// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/pk_sampler.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "random_stream.h"

namespace sdmt::train {

namespace {

// `total` seats by weight: the whole parts, then the largest remainders, ties to the first.
std::vector<int> apportion(int total, const std::vector<double>& weights) {
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  std::vector<int> seats;
  std::vector<std::pair<double, std::size_t>> remainders;
  int given = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const double share = total * weights[i] / sum;
    seats.push_back(static_cast<int>(share));
    given += seats.back();
    remainders.emplace_back(seats.back() - share, i);  // most negative first
  }
  std::sort(remainders.begin(), remainders.end());
  for (std::size_t i = 0; given < total; ++i, ++given) ++seats[remainders[i].second];
  return seats;
}

}  // namespace

void PkSamplerOptions::validate() const {
  io::require_in("identities", identities, kIdentities);
  io::require_in("instances", instances, kInstances);
  double sum = 0;
  for (const double weight : source_weights) {
    if (!(weight >= 0) || !std::isfinite(weight)) {
      throw std::invalid_argument("source_weights has " + std::to_string(weight) +
                                  ", expected values >= 0");
    }
    sum += weight;
  }
  if (!source_weights.empty() && sum == 0) {
    throw std::invalid_argument("source_weights are all 0, expected one above");
  }
}

PkSampler::PkSampler(std::span<const Identity> identities, int sources, PkSamplerOptions options)
    : identities_(identities),
      options_(std::move(options)),
      sources_(static_cast<std::size_t>(sources)) {
  options_.validate();
  if (identities_.empty()) {
    throw std::invalid_argument("there are no people to draw a batch from");
  }
  for (std::size_t i = 0; i < identities_.size(); ++i) {
    sources_[identities_[i].source].people.push_back(static_cast<int>(i));
  }
  std::vector<double> weights = options_.source_weights;
  if (weights.empty()) {
    for (const auto& source : sources_)
      weights.push_back(static_cast<double>(source.people.size()));
  } else if (weights.size() != sources_.size()) {
    throw std::invalid_argument("source_weights has " + std::to_string(weights.size()) +
                                " values, expected one for each of " +
                                std::to_string(sources_.size()) + " data folders");
  }
  counts_ = apportion(options_.identities, weights);
  for (std::size_t s = 0; s < sources_.size(); ++s) {
    if (static_cast<std::size_t>(counts_[s]) <= sources_[s].people.size()) continue;
    throw std::invalid_argument("identities is " + std::to_string(options_.identities) +
                                ", of which data folder " + std::to_string(s + 1) +
                                " would have to give " + std::to_string(counts_[s]) +
                                ", but it has " + std::to_string(sources_[s].people.size()));
  }
}

PkSampler::Batch PkSampler::batch(std::int64_t iteration) {
  Batch batch;
  for (std::size_t s = 0; s < sources_.size(); ++s) {
    if (counts_[s] == 0) continue;
    Source& source = sources_[s];
    const auto count = static_cast<std::size_t>(counts_[s]);
    const auto batches = static_cast<std::int64_t>(source.people.size() / count);
    const std::int64_t epoch = iteration / batches;
    if (epoch != source.epoch) {
      source.order = source.people;
      auto random = random_stream(options_.seed, Purpose::identity_order, s,
                                  static_cast<std::uint64_t>(epoch));
      random.shuffle(std::span<int>(source.order));
      source.epoch = epoch;
    }
    const auto first = static_cast<std::size_t>(iteration % batches) * count;
    batch.labels.insert(batch.labels.end(),
                        source.order.begin() + static_cast<std::ptrdiff_t>(first),
                        source.order.begin() + static_cast<std::ptrdiff_t>(first + count));
  }

  auto random =
      random_stream(options_.seed, Purpose::images, 0, static_cast<std::uint64_t>(iteration));
  const auto people = std::exchange(batch.labels, {});
  for (const int person : people) {
    std::vector<int> images = identities_[person].images;
    random.shuffle(std::span<int>(images));
    const std::size_t available = images.size();
    for (std::size_t k = 0; k < static_cast<std::size_t>(options_.instances); ++k) {
      const auto at = k < available ? k : static_cast<std::size_t>(random.below(available));
      batch.images.push_back(images[at]);
      batch.labels.push_back(person);
    }
  }
  return batch;
}

}  // namespace sdmt::train
