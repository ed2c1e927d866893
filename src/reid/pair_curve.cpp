// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/pair_curve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "sdmt/io/first_error.h"
#include "sdmt/nn/random.h"
#include "sdmt/reid/market1501.h"

namespace sdmt::reid {

namespace {

// Beyond this the pairs are not listed but counted in bins.
constexpr std::int64_t kMaxListedPairs = 2 * PairOptions::kMaxSampledPairs;
constexpr int kBins = 1 << 20;
constexpr double kLargestDistance = 2.0;  // of two points of the unit sphere

enum Kind : std::size_t { kPositive, kNegative, kDistractor, kKinds };

std::optional<Kind> kind_of(const LabelledEmbeddings& images, PairSet set, std::size_t i,
                            std::size_t j) {
  const bool background_i = images.pids[i] == kDistractorPid;
  const bool background_j = images.pids[j] == kDistractorPid;
  if (background_i || background_j) {
    if (set == PairSet::paper && background_i != background_j) return kDistractor;
    return std::nullopt;
  }
  if (set == PairSet::cross_camera && images.camids[i] == images.camids[j]) return std::nullopt;
  return images.pids[i] == images.pids[j] ? kPositive : kNegative;
}

using KindCounts = std::array<std::int64_t, kKinds>;

KindCounts count_kinds(const LabelledEmbeddings& images, PairSet set) {
  std::int64_t positives = 0;
  std::int64_t negatives = 0;
  std::int64_t distractors = 0;
  const auto n = images.pids.size();
  // nothing throws
#pragma omp parallel for schedule(dynamic, 64) reduction(+ : positives, negatives, distractors)
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      const auto kind = kind_of(images, set, i, j);
      positives += kind == kPositive ? 1 : 0;
      negatives += kind == kNegative ? 1 : 0;
      distractors += kind == kDistractor ? 1 : 0;
    }
  }
  return {positives, negatives, distractors};
}

struct ListedPair {
  std::int32_t i = 0;
  std::int32_t j = 0;
};

// `wanted` pairs of each kind out of `available`, in the order of the images: selection sampling
// (Knuth, TAOCP 2, 3.4.2, algorithm S). All of them when both are equal.
std::vector<ListedPair> select_pairs(const LabelledEmbeddings& images, PairSet set,
                                     KindCounts available, KindCounts wanted, std::uint64_t seed) {
  constexpr std::uint64_t kStream = 0x70616972;  // apart from the bootstrap's streams
  nn::Random random(seed, kStream);
  std::vector<ListedPair> pairs;
  pairs.reserve(static_cast<std::size_t>(wanted[0] + wanted[1] + wanted[2]));
  const auto n = images.pids.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      const auto kind = kind_of(images, set, i, j);
      if (!kind) continue;
      std::int64_t& left = available[*kind];
      std::int64_t& needed = wanted[*kind];
      if (needed == left ||
          static_cast<double>(left) * random.uniform() < static_cast<double>(needed)) {
        pairs.push_back({static_cast<std::int32_t>(i), static_cast<std::int32_t>(j)});
        --needed;
      }
      --left;
    }
  }
  return pairs;
}

// In slices of the dimensions, so that long vectors (feature maps of 131,072 values) are read from
// the cache.
std::vector<float> euclidean_distances(const LabelledEmbeddings& images,
                                       const std::vector<ListedPair>& pairs) {
  constexpr int kSlice = 512;
  std::vector<float> distances(pairs.size(), 0.0F);
  const int dimensions = images.dimensions();
  for (int begin = 0; begin < dimensions; begin += kSlice) {
    const int end = std::min(begin + kSlice, dimensions);
    // nothing throws
#pragma omp parallel for
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      distances[p] += squared_distance(images.embeddings.image(pairs[p].i),
                                       images.embeddings.image(pairs[p].j), begin, end);
    }
  }
  for (float& d : distances) d = std::sqrt(d);
  return distances;
}

std::vector<float> distances_of(const LabelledEmbeddings& images,
                                const std::vector<ListedPair>& pairs,
                                const PairDistance& distance) {
  if (!distance) return euclidean_distances(images, pairs);
  std::vector<float> distances(pairs.size());
  io::FirstError error;
#pragma omp parallel for
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    error.guard([&] {
      distances[p] =
          distance(images.embeddings.image(pairs[p].i), images.embeddings.image(pairs[p].j));
    });
  }
  error.rethrow();
  return distances;
}

// The distances of all pairs of the set, in bins. Counts are integers: the order does not matter.
Roc counted_curve(const LabelledEmbeddings& images, PairSet set, const PairDistance& distance) {
  std::vector<DistanceCount> counts(kBins);
  const double width = kLargestDistance / kBins;
  for (std::size_t b = 0; b < counts.size(); ++b) {
    counts[b].distance = (static_cast<double>(b) + 0.5) * width;
  }
  const auto n = images.pids.size();
  const int dimensions = images.dimensions();
  io::FirstError error;
#pragma omp parallel
  {
    std::vector<std::array<std::int64_t, 2>> own;
    error.guard([&] { own.resize(kBins); });
#pragma omp for schedule(dynamic, 16)
    for (std::size_t i = 0; i < n; ++i) {
      if (own.empty()) continue;
      error.guard([&] {
        for (std::size_t j = i + 1; j < n; ++j) {
          const auto kind = kind_of(images, set, i, j);
          if (!kind) continue;
          const float* a = images.embeddings.image(static_cast<int>(i));
          const float* b = images.embeddings.image(static_cast<int>(j));
          const float d = distance ? distance(a, b) : euclidean_distance(a, b, dimensions);
          const auto bin = std::min(static_cast<int>(d / width), kBins - 1);
          ++own[bin][*kind == kPositive ? 0 : 1];
        }
      });
    }
#pragma omp critical
    for (std::size_t b = 0; b < own.size(); ++b) {
      counts[b].positives += own[b][0];
      counts[b].negatives += own[b][1];
    }
  }
  error.rethrow();
  return Roc(std::move(counts));
}

Roc listed_curve(const LabelledEmbeddings& images, const std::vector<ListedPair>& pairs,
                 const std::vector<float>& distances) {
  std::vector<float> positives;
  std::vector<float> negatives;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const bool same = images.pids[pairs[p].i] == images.pids[pairs[p].j];
    (same ? positives : negatives).push_back(distances[p]);
  }
  return Roc(positives, negatives);
}

struct Clusters {
  std::vector<std::int32_t> of_image;
  int identities = 0;
  int backgrounds = 0;
};

// Identities in ascending order, then each background image for itself.
Clusters cluster(const std::vector<int>& pids) {
  std::map<int, std::int32_t> index;
  for (const int pid : pids) {
    if (pid != kDistractorPid) index.emplace(pid, 0);
  }
  Clusters clusters;
  for (auto& [pid, number] : index) number = clusters.identities++;
  for (const int pid : pids) {
    clusters.of_image.push_back(pid == kDistractorPid ? clusters.identities + clusters.backgrounds++
                                                      : index.at(pid));
  }
  return clusters;
}

void check_both_classes(const PairCounts& counts, std::size_t images, int identities) {
  const auto among = " among " + std::to_string(images) + " images of " +
                     std::to_string(identities) + (identities == 1 ? " person" : " people");
  if (counts.positives == 0) {
    throw std::invalid_argument("there is no pair of images of one person" + among);
  }
  if (counts.negatives == 0) {
    throw std::invalid_argument("there is no pair of images of two people" + among);
  }
}

}  // namespace

PairCounts count_pairs(const LabelledEmbeddings& images, PairSet set) {
  const KindCounts kinds = count_kinds(images, set);
  return {kinds[kPositive], kinds[kNegative], kinds[kDistractor]};
}

void PairOptions::validate() const {
  if (pairs < 0 || pairs > kMaxSampledPairs) {
    throw std::invalid_argument("pairs is " + std::to_string(pairs) + ", expected 0 (all) to " +
                                std::to_string(kMaxSampledPairs));
  }
}

PairCurve pair_curve(const LabelledEmbeddings& images, const PairOptions& options,
                     const PairDistance& distance) {
  options.validate();
  images.validate();
  if (!distance) images.validate_unit_rows();
  const Clusters clusters = cluster(images.pids);
  const PairCounts found = count_pairs(images, options.set);
  check_both_classes(found, images.pids.size(), clusters.identities);

  const KindCounts available = {found.positives, found.negatives, found.distractors};
  KindCounts wanted = available;
  if (options.set == PairSet::paper) {
    std::int64_t equal = std::min(found.positives, found.negatives);
    if (found.distractors > 0) equal = std::min(equal, found.distractors);
    for (auto& count : wanted) count = std::min(count, equal);
  }
  if (options.pairs > 0) {
    for (auto& count : wanted) count = std::min(count, options.pairs);
  }
  const bool all = wanted == available;
  const bool counted = wanted[0] + wanted[1] + wanted[2] > kMaxListedPairs;
  KindCounts listed = wanted;
  if (counted) {
    for (auto& count : listed) count = std::min(count, PairOptions::kMaxSampledPairs);
  }
  const auto pairs = select_pairs(images, options.set, available, listed, options.seed);
  const auto distances = distances_of(images, pairs, distance);

  PairCurve curve{counted && all ? counted_curve(images, options.set, distance)
                                 : listed_curve(images, pairs, distances),
                  {},
                  {},
                  clusters.identities,
                  clusters.backgrounds};
  const KindCounts& used = counted && all ? wanted : listed;
  curve.counts = {used[kPositive], used[kNegative], used[kDistractor]};
  curve.pairs.reserve(pairs.size());
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    curve.pairs.push_back(
        {distances[p], clusters.of_image[pairs[p].i], clusters.of_image[pairs[p].j]});
  }
  return curve;
}

HardestPairs hardest_pairs(const LabelledEmbeddings& images, std::size_t count) {
  images.validate();
  const int n = images.size();
  std::vector<ImagePair> farthest(static_cast<std::size_t>(n), {-1, -1, -1.0F});
  std::vector<ImagePair> nearest = farthest;
  // nothing throws
#pragma omp parallel for schedule(dynamic, 16)
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      if (j == i) continue;
      const auto kind = kind_of(images, PairSet::person_only, i, j);
      if (!kind) continue;
      const float d = euclidean_distance(images.embeddings.image(i), images.embeddings.image(j),
                                         images.dimensions());
      ImagePair& held = *kind == kPositive ? farthest[i] : nearest[i];
      const bool harder = *kind == kPositive ? d > held.distance : d < held.distance;
      if (held.first < 0 || harder) held = {i, j, d};
    }
  }
  const auto pick = [&](std::vector<ImagePair> pairs, auto before) {
    std::erase_if(pairs, [](const ImagePair& pair) { return pair.first < 0; });
    std::stable_sort(pairs.begin(), pairs.end(), before);
    std::set<std::pair<int, int>> seen;
    std::vector<ImagePair> picked;
    for (const ImagePair& pair : pairs) {
      if (picked.size() == count) break;
      const auto [low, high] = std::minmax(images.pids[pair.first], images.pids[pair.second]);
      if (seen.insert({low, high}).second) picked.push_back(pair);
    }
    return picked;
  };
  return {pick(std::move(farthest),
               [](const auto& a, const auto& b) { return a.distance > b.distance; }),
          pick(std::move(nearest),
               [](const auto& a, const auto& b) { return a.distance < b.distance; })};
}

}  // namespace sdmt::reid
