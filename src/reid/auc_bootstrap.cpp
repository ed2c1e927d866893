// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/auc_bootstrap.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "sdmt/io/checked_value.h"
#include "sdmt/io/first_error.h"
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

// What a draw gives.
struct Drawn {
  double auc = 0;
  double tpr = 0;
  double fpr = 0;
  double tau_a = 0;
};

// Calls visit(distance, positives, negatives) with the weights of each distance, ascending, until
// it returns false. `pairs` are sorted by distance.
template <typename Visit>
void for_each_distance(const std::vector<ClusterPair>& pairs,
                       const std::vector<std::int64_t>& weights, Visit visit) {
  for (std::size_t i = 0; i < pairs.size();) {
    std::int64_t positives = 0;
    std::int64_t negatives = 0;
    const float distance = pairs[i].distance;
    for (; i < pairs.size() && pairs[i].distance == distance; ++i) {
      const int first = pairs[i].first;
      const int second = pairs[i].second;
      if (first == second) {
        positives += weights[first];
      } else {
        negatives += weights[first] * weights[second];
      }
    }
    if (positives + negatives > 0 && !visit(distance, positives, negatives)) return;
  }
}

// Midway between the last distance that passes and the first that does not, as Roc has it.
double threshold_at_fpr(const std::vector<ClusterPair>& pairs,
                        const std::vector<std::int64_t>& weights, double most_negatives) {
  std::int64_t negatives = 0;
  double last = 0;
  double threshold = -1;
  for_each_distance(pairs, weights, [&](double distance, std::int64_t, std::int64_t here) {
    negatives += here;
    if (static_cast<double>(negatives) > most_negatives) {
      threshold = 0.5 * (last + distance);
      return false;
    }
    last = distance;
    return true;
  });
  return threshold < 0 ? last : threshold;
}

// Mann-Whitney's U and rates by weight, in integers, so that no order of summation matters; nothing
// when a class has no weight.
std::optional<Drawn> draw_curve(const std::vector<ClusterPair>& pairs,
                                const std::vector<std::int64_t>& weights,
                                const OperatingPoints& points) {
  std::int64_t positives = 0;
  std::int64_t negatives = 0;
  std::int64_t twice_u = 0;
  std::int64_t passing_positives = 0;
  std::int64_t passing_negatives = 0;
  for_each_distance(pairs, weights, [&](double distance, std::int64_t p, std::int64_t n) {
    twice_u += n * (2 * positives + p);
    positives += p;
    negatives += n;
    if (distance <= 1 - points.tau_a) {
      passing_positives = positives;
      passing_negatives = negatives;
    }
    return true;
  });
  if (positives == 0 || negatives == 0) return std::nullopt;
  const auto p = static_cast<double>(positives);
  const auto n = static_cast<double>(negatives);
  return Drawn{static_cast<double>(twice_u) / 2 / p / n, static_cast<double>(passing_positives) / p,
               static_cast<double>(passing_negatives) / n,
               1 - threshold_at_fpr(pairs, weights, points.target_fpr * n)};
}

// Linear between order statistics, as numpy.percentile does by default.
double percentile(const std::vector<double>& ascending, double share) {
  const double position = share * static_cast<double>(ascending.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, ascending.size() - 1);
  const double part = position - static_cast<double>(below);
  return ascending[below] + part * (ascending[above] - ascending[below]);
}

Interval interval(const std::vector<Drawn>& drawn, double Drawn::*value, double confidence) {
  std::vector<double> values;
  for (const Drawn& draw : drawn) values.push_back(draw.*value);
  std::sort(values.begin(), values.end());
  const double tail = 0.5 * (1.0 - confidence);
  return {percentile(values, tail), percentile(values, 1.0 - tail)};
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

CurveIntervals bootstrap_curve(std::vector<ClusterPair> pairs, int identities, int backgrounds,
                               const OperatingPoints& points, const BootstrapOptions& options) {
  options.validate();
  io::require_in("bootstrap: target_fpr", points.target_fpr, 0.0, 1.0);
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
  std::vector<std::optional<Drawn>> draws(static_cast<std::size_t>(options.draws));
  io::FirstError error;
#pragma omp parallel for schedule(dynamic)
  for (int draw = 0; draw < options.draws; ++draw) {
    error.guard([&] {
      const nn::Random random(options.seed, static_cast<std::uint64_t>(draw));
      draws[draw] = draw_curve(pairs, draw_weights(identities, backgrounds, random), points);
    });
  }
  error.rethrow();
  std::vector<Drawn> drawn;
  for (const auto& draw : draws) {
    if (draw) drawn.push_back(*draw);
  }
  if (drawn.empty()) {
    throw std::invalid_argument("bootstrap: no draw has both positive and negative pairs");
  }
  const auto of = [&](double Drawn::*value) { return interval(drawn, value, options.confidence); };
  return {of(&Drawn::auc), of(&Drawn::tpr), of(&Drawn::fpr), of(&Drawn::tau_a)};
}

Interval bootstrap_auc(std::vector<ClusterPair> pairs, int identities, int backgrounds,
                       const BootstrapOptions& options) {
  return bootstrap_curve(std::move(pairs), identities, backgrounds, {}, options).auc;
}

}  // namespace sdmt::reid
