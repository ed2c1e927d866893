// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/hota.h"

#include <algorithm>
#include <cmath>

#include "pair_table.h"
#include "sdmt/mot/assignment.h"

namespace sdmt::eval {

namespace {

// Keeps loca defined where nothing matched; TrackEval's value.
constexpr double kTiny = 1e-10;

struct IdCounts {
  std::vector<double> gt, result;

  explicit IdCounts(const SequenceSimilarities& sequence)
      : gt(sequence.num_gt_ids, 0.0), result(sequence.num_result_ids, 0.0) {
    for (const auto& frame : sequence.frames) {
      for (const int id : frame.gt_ids) gt[id] += 1;
      for (const int id : frame.result_ids) result[id] += 1;
    }
  }
  double gt_of(const PairTable::Ids& pair) const { return gt[pair.gt_id]; }
  double result_of(const PairTable::Ids& pair) const { return result[pair.result_id]; }
};

// How well each pair of ids agrees over the whole sequence: a soft Jaccard index, in which each
// overlap counts by its share among the overlaps of its two boxes.
std::vector<double> global_alignment(const SequenceSimilarities& sequence, const PairTable& table,
                                     const IdCounts& counts) {
  std::vector<double> shared(table.pairs().size(), 0.0);
  std::vector<double> of_gt, of_result;
  std::size_t k = 0;
  for (const auto& frame : sequence.frames) {
    of_gt.assign(frame.gt_ids.size(), 0.0);
    of_result.assign(frame.result_ids.size(), 0.0);
    for (const auto& overlap : frame.overlaps) {
      of_gt[overlap.gt] += overlap.similarity;
      of_result[overlap.result] += overlap.similarity;
    }
    for (const auto& overlap : frame.overlaps) {
      const double all = of_gt[overlap.gt] + of_result[overlap.result] - overlap.similarity;
      const std::size_t pair = table.of_overlap()[k++];
      if (all > kSimilaritySlack) shared[pair] += overlap.similarity / all;
    }
  }
  for (std::size_t pair = 0; pair < shared.size(); ++pair) {
    const auto& ids = table.pairs()[pair];
    shared[pair] /= counts.gt_of(ids) + counts.result_of(ids) - shared[pair];
  }
  return shared;
}

// From counts and from sums over the matched boxes to ratios.
void take_ratios(HotaScores& s) {
  for (std::size_t a = 0; a < kNumAlphas; ++a) {
    const auto tp = static_cast<double>(s.hota_tp[a]);
    s.assa[a] /= std::max(1.0, tp);
    s.assre[a] /= std::max(1.0, tp);
    s.asspr[a] /= std::max(1.0, tp);
    s.loca[a] = std::max(kTiny, s.loca[a]) / std::max(kTiny, tp);
    const auto fn = static_cast<double>(s.hota_fn[a]);
    const auto fp = static_cast<double>(s.hota_fp[a]);
    s.detre[a] = tp / std::max(1.0, tp + fn);
    s.detpr[a] = tp / std::max(1.0, tp + fp);
    s.deta[a] = tp / std::max(1.0, tp + fn + fp);
    s.hota[a] = std::sqrt(s.deta[a] * s.assa[a]);
    s.owta[a] = std::sqrt(s.detre[a] * s.assa[a]);
  }
  s.hota_0 = s.hota[0];
  s.loca_0 = s.loca[0];
  s.hotaloca_0 = s.hota_0 * s.loca_0;
}

// Adds the frames' matches to the counts of `s`, and to matched[pair * kNumAlphas + alpha].
void match_frames(const SequenceSimilarities& sequence, const PairTable& table,
                  const std::vector<double>& alignment, HotaScores& s,
                  std::vector<double>& matched) {
  const auto alphas = hota_alphas();
  std::vector<mot::AssignmentEdge> edges;
  std::size_t first_overlap = 0;
  for (const auto& frame : sequence.frames) {
    edges.clear();
    for (std::size_t k = 0; k < frame.overlaps.size(); ++k) {
      const auto& overlap = frame.overlaps[k];
      const double agreement = alignment[table.of_overlap()[first_overlap + k]];
      edges.push_back({overlap.gt, overlap.result, agreement * overlap.similarity});
    }
    const auto column_of = mot::maximum_weight_assignment(
        static_cast<int>(frame.gt_ids.size()), static_cast<int>(frame.result_ids.size()), edges);
    AlphaCounts tp{};
    for (std::size_t k = 0; k < frame.overlaps.size(); ++k) {
      const auto& overlap = frame.overlaps[k];
      if (column_of[overlap.gt] != overlap.result) continue;
      const std::size_t pair = table.of_overlap()[first_overlap + k];
      for (std::size_t a = 0; a < kNumAlphas; ++a) {
        if (overlap.similarity < alphas[a] - kSimilaritySlack) break;
        ++tp[a];
        s.loca[a] += overlap.similarity;
        matched[pair * kNumAlphas + a] += 1;
      }
    }
    for (std::size_t a = 0; a < kNumAlphas; ++a) {
      s.hota_tp[a] += tp[a];
      s.hota_fn[a] += static_cast<std::int64_t>(frame.gt_ids.size()) - tp[a];
      s.hota_fp[a] += static_cast<std::int64_t>(frame.result_ids.size()) - tp[a];
    }
    first_overlap += frame.overlaps.size();
  }
}

}  // namespace

std::array<double, kNumAlphas> hota_alphas() {
  std::array<double, kNumAlphas> alphas{};
  for (std::size_t a = 0; a < kNumAlphas; ++a) alphas[a] = 0.05 + static_cast<double>(a) * 0.05;
  return alphas;
}

double mean(const AlphaScores& scores) {
  double sum = 0;
  for (const double score : scores) sum += score;
  return sum / static_cast<double>(kNumAlphas);
}

HotaScores hota(const SequenceSimilarities& sequence) {
  HotaScores s;
  if (sequence.num_result_dets() == 0 || sequence.num_gt_dets() == 0) {
    s.hota_fn.fill(sequence.num_gt_dets());
    s.hota_fp.fill(sequence.num_result_dets());
    s.loca.fill(1.0);
    s.loca_0 = 1.0;
    return s;
  }
  const PairTable table(sequence);
  const IdCounts counts(sequence);
  std::vector<double> matched(table.pairs().size() * kNumAlphas, 0.0);
  match_frames(sequence, table, global_alignment(sequence, table, counts), s, matched);
  for (std::size_t pair = 0; pair < table.pairs().size(); ++pair) {
    const double in_gt = counts.gt_of(table.pairs()[pair]);
    const double in_result = counts.result_of(table.pairs()[pair]);
    for (std::size_t a = 0; a < kNumAlphas; ++a) {
      const double both = matched[pair * kNumAlphas + a];
      s.assa[a] += both * (both / std::max(1.0, in_gt + in_result - both));
      s.assre[a] += both * (both / std::max(1.0, in_gt));
      s.asspr[a] += both * (both / std::max(1.0, in_result));
    }
  }
  take_ratios(s);
  return s;
}

HotaScores combine(std::span<const HotaScores> sequences) {
  HotaScores sum;
  for (const auto& s : sequences) {
    for (std::size_t a = 0; a < kNumAlphas; ++a) {
      const auto tp = static_cast<double>(s.hota_tp[a]);
      sum.hota_tp[a] += s.hota_tp[a];
      sum.hota_fn[a] += s.hota_fn[a];
      sum.hota_fp[a] += s.hota_fp[a];
      sum.assa[a] += s.assa[a] * tp;
      sum.assre[a] += s.assre[a] * tp;
      sum.asspr[a] += s.asspr[a] * tp;
      sum.loca[a] += s.loca[a] * tp;
    }
  }
  take_ratios(sum);
  return sum;
}

}  // namespace sdmt::eval
