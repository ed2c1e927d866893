// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/reid_metrics.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "sdmt/io/first_error.h"
#include "sdmt/reid/market1501.h"

namespace sdmt::reid {

namespace {

// The gallery as the query ranks it, without what is passed over: is each result right?
std::vector<bool> ranking(const LabelledEmbeddings& queries, int query,
                          const LabelledEmbeddings& gallery) {
  const int pid = queries.pids[query];
  const int camid = queries.camids[query];
  std::vector<std::pair<float, int>> results;  // ordered by distance, then by index
  results.reserve(gallery.pids.size());
  for (int g = 0; g < gallery.size(); ++g) {
    if (gallery.pids[g] == pid && gallery.camids[g] == camid) continue;
    results.emplace_back(euclidean_distance(queries.embeddings.image(query),
                                            gallery.embeddings.image(g), queries.dimensions()),
                         g);
  }
  std::sort(results.begin(), results.end());
  std::vector<bool> right;
  right.reserve(results.size());
  for (const auto& [distance, g] : results) {
    right.push_back(gallery.pids[g] == pid);
  }
  return right;
}

struct QueryScore {
  std::int64_t first_hit = -1;  // 0 = the nearest result; -1: nothing to find
  AveragePrecision precision;
};

}  // namespace

AveragePrecision average_precision(const std::vector<bool>& right) {
  const auto total = static_cast<double>(std::count(right.begin(), right.end(), true));
  AveragePrecision result;
  if (total == 0) return result;
  double hits = 0;
  double precision_before = 1;
  for (std::size_t r = 0; r < right.size(); ++r) {
    const double rank = static_cast<double>(r) + 1;
    hits += right[r] ? 1 : 0;
    const double precision = hits / rank;
    if (right[r]) {
      result.at_hits += precision / total;
      result.trapezoid += 0.5 * (precision_before + precision) / total;
    }
    precision_before = precision;
  }
  return result;
}

std::optional<ReidMetrics> reid_metrics(const LabelledEmbeddings& queries,
                                        const LabelledEmbeddings& gallery) {
  queries.validate();
  gallery.validate();
  if (queries.dimensions() != gallery.dimensions()) {
    throw std::invalid_argument("queries have " + std::to_string(queries.dimensions()) +
                                " dimensions and the gallery " +
                                std::to_string(gallery.dimensions()) + ", expected the same");
  }
  for (std::size_t q = 0; q < queries.pids.size(); ++q) {
    if (queries.pids[q] == kDistractorPid) {
      throw std::invalid_argument("query " + std::to_string(q) + " is a distractor");
    }
  }
  std::vector<QueryScore> scores(queries.pids.size());
  io::FirstError error;
#pragma omp parallel for schedule(dynamic)
  for (int q = 0; q < queries.size(); ++q) {
    error.guard([&] {
      const auto right = ranking(queries, q, gallery);
      const auto hit = std::find(right.begin(), right.end(), true);
      if (hit == right.end()) return;
      scores[q] = {hit - right.begin(), average_precision(right)};
    });
  }
  error.rethrow();
  ReidMetrics metrics;
  for (const QueryScore& score : scores) {
    if (score.first_hit < 0) {
      ++metrics.queries_without_match;
      continue;
    }
    ++metrics.queries;
    metrics.rank1 += score.first_hit < 1 ? 1 : 0;
    metrics.rank5 += score.first_hit < 5 ? 1 : 0;
    metrics.rank10 += score.first_hit < 10 ? 1 : 0;
    metrics.map += score.precision.at_hits;
    metrics.map_trapezoid += score.precision.trapezoid;
  }
  if (metrics.queries == 0) return std::nullopt;
  for (double* sum :
       {&metrics.rank1, &metrics.rank5, &metrics.rank10, &metrics.map, &metrics.map_trapezoid}) {
    *sum /= static_cast<double>(metrics.queries);
  }
  return metrics;
}

}  // namespace sdmt::reid
