// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/identity.h"

#include <algorithm>
#include <cmath>

#include "pair_table.h"
#include "sdmt/mot/assignment.h"

namespace sdmt::eval {

namespace {

constexpr double kThreshold = 0.5;  // TrackEval allows no slack here

void take_ratios(IdentityScores& s) {
  const auto tp = static_cast<double>(s.idtp);
  const auto fn = static_cast<double>(s.idfn);
  const auto fp = static_cast<double>(s.idfp);
  s.idr = tp / std::max(1.0, tp + fn);
  s.idp = tp / std::max(1.0, tp + fp);
  s.idf1 = tp / std::max(1.0, tp + 0.5 * fp + 0.5 * fn);
}

}  // namespace

IdentityScores identity(const SequenceSimilarities& sequence) {
  const PairTable table(sequence);
  std::vector<mot::AssignmentEdge> edges;
  for (const auto& pair : table.pairs()) edges.push_back({pair.gt_id, pair.result_id, 0.0});
  std::size_t k = 0;
  for (const auto& frame : sequence.frames) {
    for (const auto& overlap : frame.overlaps) {
      if (overlap.similarity >= kThreshold) edges[table.of_overlap()[k]].weight += 1.0;
      ++k;
    }
  }
  // Leaving a person or a result id alone costs its boxes; assigning the two saves the shared
  // frames twice. So the cheapest assignment is the one with most shared frames.
  const auto result_of =
      mot::maximum_weight_assignment(sequence.num_gt_ids, sequence.num_result_ids, edges);
  double shared = 0;
  for (const auto& edge : edges) {
    if (result_of[edge.row] == edge.column) shared += edge.weight;
  }
  IdentityScores scores;
  scores.idtp = std::llround(shared);
  scores.idfn = sequence.num_gt_dets() - scores.idtp;
  scores.idfp = sequence.num_result_dets() - scores.idtp;
  take_ratios(scores);
  return scores;
}

IdentityScores combine(std::span<const IdentityScores> sequences) {
  IdentityScores sum;
  for (const auto& s : sequences) {
    sum.idtp += s.idtp;
    sum.idfn += s.idfn;
    sum.idfp += s.idfp;
  }
  take_ratios(sum);
  return sum;
}

}  // namespace sdmt::eval
