// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/auc_bootstrap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "sdmt/nn/random.h"

namespace sdmt::reid {

namespace {

// How often each cluster was drawn.
std::vector<std::int64_t> draw_weights(int identities, int backgrounds, nn::Random random) {
  const auto persons = static_cast<std::size_t>(identities);
  const auto others = static_cast<std::size_t>(backgrounds);
  std::vector<std::int64_t> weights(persons + others, 0);
  for (std::size_t i = 0; i < persons; ++i) ++weights[random.below(persons)];
  for (std::size_t i = 0; i < others; ++i) ++weights[persons + random.below(others)];
  return weights;
}

// Mann-Whitney's U by weight, in integers, so that no order of summation matters; NaN when a class
// has no weight. `pairs` are sorted by distance.
double weighted_auc(const std::vector<ClusterPair>& pairs,
                    const std::vector<std::int64_t>& weights) {
  std::int64_t positives = 0;
  std::int64_t negatives = 0;
  std::int64_t twice_u = 0;
  for (std::size_t i = 0; i < pairs.size();) {
    std::int64_t tied_positives = 0;
    std::int64_t tied_negatives = 0;
    const float distance = pairs[i].distance;
    for (; i < pairs.size() && pairs[i].distance == distance; ++i) {
      const int first = pairs[i].first;
      const int second = pairs[i].second;
      if (first == second) {
        tied_positives += weights[first];
      } else {
        tied_negatives += weights[first] * weights[second];
      }
    }
    twice_u += tied_negatives * (2 * positives + tied_positives);
    positives += tied_positives;
    negatives += tied_negatives;
  }
  if (positives == 0 || negatives == 0) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(twice_u) / 2 / static_cast<double>(positives) /
         static_cast<double>(negatives);
}

// Linear between order statistics, as numpy.percentile does by default.
double percentile(const std::vector<double>& ascending, double share) {
  const double position = share * static_cast<double>(ascending.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, ascending.size() - 1);
  const double part = position - static_cast<double>(below);
  return ascending[below] + part * (ascending[above] - ascending[below]);
}

}  // namespace

void BootstrapOptions::validate() const {
  if (draws < 2) {
    throw std::invalid_argument("draws is " + std::to_string(draws) + ", expected at least 2");
  }
  if (!(confidence > 0.0 && confidence < 1.0)) {
    throw std::invalid_argument("confidence is " + std::to_string(confidence) +
                                ", expected between 0 and 1");
  }
}

AucInterval bootstrap_auc(std::vector<ClusterPair> pairs, int identities, int backgrounds,
                          const BootstrapOptions& options) {
  options.validate();
  for (const ClusterPair& pair : pairs) {
    const int clusters = identities + backgrounds;
    if (pair.first < 0 || pair.first >= clusters || pair.second < 0 || pair.second >= clusters ||
        !std::isfinite(pair.distance)) {
      throw std::invalid_argument("bootstrap: pair of clusters " + std::to_string(pair.first) +
                                  " and " + std::to_string(pair.second) + " at distance " +
                                  std::to_string(pair.distance) + ", expected clusters 0 to " +
                                  std::to_string(clusters - 1) + " and a finite distance");
    }
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const ClusterPair& a, const ClusterPair& b) { return a.distance < b.distance; });
  std::vector<double> areas(static_cast<std::size_t>(options.draws));
#pragma omp parallel for schedule(dynamic)
  for (int draw = 0; draw < options.draws; ++draw) {
    const nn::Random random(options.seed, static_cast<std::uint64_t>(draw));
    areas[draw] = weighted_auc(pairs, draw_weights(identities, backgrounds, random));
  }
  std::erase_if(areas, [](double area) { return std::isnan(area); });
  if (areas.empty()) {
    throw std::invalid_argument("bootstrap: no draw has both positive and negative pairs");
  }
  std::sort(areas.begin(), areas.end());
  const double tail = 0.5 * (1.0 - options.confidence);
  return {percentile(areas, tail), percentile(areas, 1.0 - tail)};
}

}  // namespace sdmt::reid
