// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/batch_hard_loss.h"

#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

namespace sdmt::train {

namespace {

constexpr double kDistanceEps = 1e-12;

// All distances, [n, n]; the rows are independent, so threads change nothing.
template <typename T>
std::vector<double> pairwise_distances(std::span<const T> rows, std::size_t n, std::size_t dim) {
  constexpr std::size_t kWorthThreads = 100000;
  std::vector<double> distances(n * n, 0.0);
  // nothing throws
#pragma omp parallel for schedule(static, 1) if (n * n * dim > kWorthThreads)
  for (std::ptrdiff_t row = 0; row < static_cast<std::ptrdiff_t>(n); ++row) {
    const auto i = static_cast<std::size_t>(row);
    for (std::size_t j = i + 1; j < n; ++j) {
      double sum = 0;
      for (std::size_t k = 0; k < dim; ++k) {
        const double difference = static_cast<double>(rows[i * dim + k]) - rows[j * dim + k];
        sum += difference * difference;
      }
      distances[i * n + j] = distances[j * n + i] = std::sqrt(sum + kDistanceEps);
    }
  }
  return distances;
}

struct HardPair {
  std::ptrdiff_t partner = -1;  // none
  double distance = 0;
};

struct HardPairs {
  HardPair positive;
  HardPair negative;
};

HardPairs mine(std::size_t anchor, std::span<const double> distances, std::span<const int> labels,
               std::span<const int> samples, const Strangers& strangers) {
  HardPairs hard;
  const std::size_t n = labels.size();
  for (std::size_t j = 0; j < n; ++j) {
    const double distance = distances[anchor * n + j];
    const bool same_person = labels[j] == labels[anchor];
    if (same_person && samples[j] == samples[anchor]) continue;
    if (!same_person && strangers && !strangers(labels[anchor], labels[j])) continue;
    HardPair& pair = same_person ? hard.positive : hard.negative;
    const bool harder = same_person ? distance > pair.distance : distance < pair.distance;
    if (pair.partner < 0 || harder) pair = {static_cast<std::ptrdiff_t>(j), distance};
  }
  return hard;
}

double softplus(double x) { return x > 0 ? x + std::log1p(std::exp(-x)) : std::log1p(std::exp(x)); }
double sigmoid(double x) { return 1.0 / (1.0 + std::exp(-x)); }

// Loss terms of one anchor, not yet divided by their number, and their derivatives.
struct Terms {
  double loss = 0;
  double d_positive = 0;  // dL / d(distance to the positive)
  double d_negative = 0;
  bool active_negative = false;
};

Terms anchor_terms(const HardPairs& hard, const BatchHardOptions& options) {
  Terms terms;
  const bool has_positive = hard.positive.partner >= 0;
  const bool has_negative = hard.negative.partner >= 0;
  const double dp = hard.positive.distance;
  const double dn = hard.negative.distance;
  if (options.kind == LossKind::contrastive) {
    if (has_positive) {
      terms.loss += 0.5 * dp * dp;
      terms.d_positive = dp;
    }
    if (has_negative && dn < options.margin) {
      terms.loss += 0.5 * (options.margin - dn) * (options.margin - dn);
      terms.d_negative = dn - options.margin;
      terms.active_negative = true;
    }
  } else if (has_positive && has_negative) {
    const double x = options.triplet_scale * (dp - dn);
    terms.loss = softplus(x) / options.triplet_scale;
    terms.d_positive = sigmoid(x);
    terms.d_negative = -sigmoid(x);
    terms.active_negative = dn < dp;
  }
  return terms;
}

template <typename T>
double embedding_spread(std::span<const T> rows, std::size_t n, std::size_t dim) {
  double sum = 0;
  for (std::size_t k = 0; k < dim; ++k) {
    double mean = 0;
    for (std::size_t i = 0; i < n; ++i) mean += rows[i * dim + k];
    mean /= static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i) {
      sum += (rows[i * dim + k] - mean) * (rows[i * dim + k] - mean);
    }
  }
  return std::sqrt(sum / static_cast<double>(n));
}

}  // namespace

void BatchHardOptions::validate() const {
  io::require_in("margin", margin, kMargin);
  io::require_in("triplet_scale", triplet_scale, kTripletScale);
}

template <typename T>
BatchHardResult batch_hard_loss(std::span<const T> embeddings, std::span<const int> labels,
                                std::span<const int> samples, const BatchHardOptions& options,
                                std::span<T> gradient, const Strangers& strangers) {
  options.validate();
  const std::size_t n = labels.size();
  if (n < 2 || samples.size() != n || embeddings.size() % n != 0 ||
      gradient.size() != embeddings.size()) {
    throw std::invalid_argument(
        "batch_hard_loss: " + std::to_string(embeddings.size()) + " values, " + std::to_string(n) +
        " labels, " + std::to_string(samples.size()) + " samples and " +
        std::to_string(gradient.size()) + " gradients do not make a batch of two or more");
  }
  const std::size_t dim = embeddings.size() / n;
  const auto distances = pairwise_distances(embeddings, n, dim);
  const bool contrastive = options.kind == LossKind::contrastive;
  const double weight = 1.0 / static_cast<double>(contrastive ? 2 * n : n);

  BatchHardResult result;
  std::vector<double> sums(embeddings.size(), 0.0);
  // d(distance)/d(e_a) = (e_a - e_b) / distance, and the opposite for e_b.
  const auto add_gradient = [&](std::size_t a, const HardPair& pair, double derivative) {
    if (derivative == 0 || pair.partner < 0) return;
    const std::ptrdiff_t b = pair.partner;
    const double scale = weight * derivative / pair.distance;
    for (std::size_t k = 0; k < dim; ++k) {
      const double difference =
          scale * (static_cast<double>(embeddings[a * dim + k]) - embeddings[b * dim + k]);
      sums[a * dim + k] += difference;
      sums[b * dim + k] -= difference;
    }
  };
  std::size_t positives = 0, negatives = 0, active = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const HardPairs hard = mine(i, distances, labels, samples, strangers);
    const Terms terms = anchor_terms(hard, options);
    result.loss += weight * terms.loss;
    add_gradient(i, hard.positive, terms.d_positive);
    add_gradient(i, hard.negative, terms.d_negative);
    if (hard.positive.partner >= 0) {
      ++positives;
      result.mining.hardest_positive += hard.positive.distance;
    }
    if (hard.negative.partner >= 0) {
      ++negatives;
      result.mining.hardest_negative += hard.negative.distance;
    }
    if (terms.active_negative) ++active;
  }
  for (std::size_t i = 0; i < sums.size(); ++i) gradient[i] = static_cast<T>(sums[i]);

  double total = 0;
  for (const double distance : distances) total += distance;
  MiningStatistics& mining = result.mining;
  mining.mean_distance = total / static_cast<double>(n * (n - 1));
  if (positives > 0) mining.hardest_positive /= static_cast<double>(positives);
  if (negatives > 0) mining.hardest_negative /= static_cast<double>(negatives);
  mining.active_negatives = static_cast<double>(active) / static_cast<double>(n);
  mining.spread = embedding_spread(embeddings, n, dim);
  return result;
}

template BatchHardResult batch_hard_loss<float>(std::span<const float>, std::span<const int>,
                                                std::span<const int>, const BatchHardOptions&,
                                                std::span<float>, const Strangers&);
template BatchHardResult batch_hard_loss<double>(std::span<const double>, std::span<const int>,
                                                 std::span<const int>, const BatchHardOptions&,
                                                 std::span<double>, const Strangers&);

std::string CollapseMonitor::add(const MiningStatistics& mining) {
  constexpr int kPatience = 50;
  constexpr double kPoint = 1e-3;
  // Without active negatives a finished training looks alike, but has its positives close.
  const bool inactive =
      mining.active_negatives == 0 && mining.hardest_positive > 0.5 * mining.hardest_negative;
  inactive_ = inactive ? inactive_ + 1 : 0;
  collapsed_ = mining.spread < kPoint ? collapsed_ + 1 : 0;
  if (collapsed_ == kPatience) {
    return "all embeddings have collapsed into one point (spread " + std::to_string(mining.spread) +
           "): lower the learning rate";
  }
  if (inactive_ == kPatience) {
    return "no negative pair is within the margin (mean distance " +
           std::to_string(mining.mean_distance) +
           "), only the pull of the positives acts: start the batch normalisation at a smaller "
           "gamma, or raise the margin";
  }
  return {};
}

}  // namespace sdmt::train
