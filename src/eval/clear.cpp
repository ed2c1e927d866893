// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/clear.h"

#include <algorithm>
#include <cmath>

#include "sdmt/mot/assignment.h"

namespace sdmt::eval {

namespace {

constexpr double kThreshold = 0.5 - kSimilaritySlack;
// Outweighs any sum of similarities in a frame of fewer than a thousand boxes; TrackEval's value.
constexpr double kBonus = 1000.0;
constexpr int kNone = -1;

struct GtTrack {
  std::int64_t frames = 0;
  std::int64_t matched = 0;
  std::int64_t segments = 0;
  int last_result = kNone;      // of the last match, however long ago
  int previous_result = kNone;  // of the frame that counts as the one before
  std::size_t last_seen = 0;    // frame number from 1; 0: never
};

class Counter {
 public:
  Counter(const SequenceSimilarities& sequence, Compat compat)
      : sequence_(sequence), devkit_(compat == Compat::devkit), tracks_(sequence.num_gt_ids) {}

  ClearScores count(ClearMatches* matches) {
    if (matches != nullptr) matches->assign(sequence_.frames.size(), {});
    for (std::size_t t = 0; t < sequence_.frames.size(); ++t) {
      auto found = frame(t);
      if (matches != nullptr) (*matches)[t] = std::move(found);
    }
    count_tracks();
    scores_.clr_frames = static_cast<std::int64_t>(sequence_.frames.size());
    return scores_;
  }

 private:
  GtTrack& track(int gt_id) { return tracks_[gt_id]; }

  std::vector<ClearMatch> frame(std::size_t t) {
    const auto& now = sequence_.frames[t];
    // TrackEval passes over a frame that lacks either side: "the frame before" stays the one
    // before it. In the devkit nothing is matched there, so the memory of pairs ends.
    const bool one_sided = now.gt_ids.empty() || now.result_ids.empty();
    std::vector<ClearMatch> matches;
    if (!one_sided) matches = match(now);
    for (auto& found : matches) {
      GtTrack& person = track(found.gt_id);
      found.previous_result_id = person.last_result;
      // Before this frame is noted: was the person there in the very frame before?
      const bool seen_before = !devkit_ || person.last_seen == t;
      found.idsw =
          person.last_result != kNone && person.last_result != found.result_id && seen_before;
      scores_.idsw += found.idsw ? 1 : 0;
      scores_.motp_sum += found.similarity;
      person.last_result = found.result_id;
      ++person.matched;
      if (person.previous_result == kNone) ++person.segments;
    }
    if (!one_sided || devkit_) {
      for (const int gt_id : previously_matched_) track(gt_id).previous_result = kNone;
      previously_matched_.clear();
      for (const auto& found : matches) {
        track(found.gt_id).previous_result = found.result_id;
        previously_matched_.push_back(found.gt_id);
      }
    }
    for (const int gt_id : now.gt_ids) {
      ++track(gt_id).frames;
      track(gt_id).last_seen = t + 1;
    }
    const auto matched = static_cast<std::int64_t>(matches.size());
    scores_.clr_tp += matched;
    scores_.clr_fn += static_cast<std::int64_t>(now.gt_ids.size()) - matched;
    scores_.clr_fp += static_cast<std::int64_t>(now.result_ids.size()) - matched;
    return matches;
  }

  std::vector<ClearMatch> match(const FrameSimilarities& now) {
    edges_.clear();
    similarity_.clear();
    for (const auto& pair : now.overlaps) {
      if (pair.similarity < kThreshold) continue;
      const int gt_id = now.gt_ids[pair.gt];
      const int result_id = now.result_ids[pair.result];
      const bool kept = track(gt_id).previous_result == result_id;
      edges_.push_back({pair.gt, pair.result, pair.similarity + (kept ? kBonus : 0.0)});
      similarity_.push_back(pair.similarity);
    }
    if (devkit_) force_kept_pairs(now);
    const auto column_of = mot::maximum_weight_assignment(
        static_cast<int>(now.gt_ids.size()), static_cast<int>(now.result_ids.size()), edges_);
    std::vector<ClearMatch> matches;
    for (std::size_t k = 0; k < edges_.size(); ++k) {
      const int row = edges_[k].row, column = edges_[k].column;
      if (column_of[row] != column) continue;
      matches.push_back({now.gt_ids[row], now.result_ids[column], similarity_[k], kNone, false});
    }
    return matches;
  }

  // Kept pairs lose every rival; among the others each match is worth more than any overlap, so
  // that as many as possible are made.
  void force_kept_pairs(const FrameSimilarities& now) {
    std::vector<unsigned char> gt_kept(now.gt_ids.size(), 0), result_kept(now.result_ids.size(), 0);
    for (const auto& edge : edges_) {
      if (edge.weight < kBonus) continue;
      gt_kept[edge.row] = 1;
      result_kept[edge.column] = 1;
    }
    std::size_t kept = 0;
    for (std::size_t k = 0; k < edges_.size(); ++k) {
      auto edge = edges_[k];
      const bool rival =
          edge.weight < kBonus && (gt_kept[edge.row] != 0 || result_kept[edge.column] != 0);
      if (rival) continue;
      if (edge.weight < kBonus) edge.weight += kBonus;
      edges_[kept] = edge;
      similarity_[kept++] = similarity_[k];
    }
    edges_.resize(kept);
    similarity_.resize(kept);
  }

  void count_tracks() {
    for (const auto& person : tracks_) {
      const double ratio = static_cast<double>(person.matched) / static_cast<double>(person.frames);
      if (ratio > 0.8) {
        ++scores_.mt;
      } else if (ratio >= 0.2) {
        ++scores_.pt;
      } else {
        ++scores_.ml;
      }
      scores_.frag += std::max<std::int64_t>(person.segments - 1, 0);
    }
  }

  const SequenceSimilarities& sequence_;
  const bool devkit_;
  std::vector<GtTrack> tracks_;
  std::vector<int> previously_matched_;
  std::vector<mot::AssignmentEdge> edges_;
  std::vector<double> similarity_;  // of edges_, without the bonus
  ClearScores scores_;
};

void take_ratios(ClearScores& s, Compat compat) {
  const auto ratio = [](double part, double whole) { return part / std::max(1.0, whole); };
  const auto tp = static_cast<double>(s.clr_tp);
  const auto fn = static_cast<double>(s.clr_fn);
  const auto fp = static_cast<double>(s.clr_fp);
  const auto idsw = static_cast<double>(s.idsw);
  const auto tracks = static_cast<double>(s.mt + s.pt + s.ml);
  s.mtr = ratio(static_cast<double>(s.mt), tracks);
  s.ptr = ratio(static_cast<double>(s.pt), tracks);
  s.mlr = ratio(static_cast<double>(s.ml), tracks);
  s.clr_re = ratio(tp, tp + fn);
  s.clr_pr = ratio(tp, tp + fp);
  s.clr_f1 = ratio(tp, tp + 0.5 * fn + 0.5 * fp);
  s.moda = ratio(tp - fp, tp + fn);
  s.mota = ratio(tp - fp - idsw, tp + fn);
  s.motp = ratio(s.motp_sum, tp);
  s.smota = ratio(s.motp_sum - fp - idsw, tp + fn);
  s.fp_per_frame = ratio(fp, static_cast<double>(s.clr_frames));
  double log_idsw = 0;
  if (compat == Compat::devkit) {
    log_idsw = std::log10(idsw + 1);
  } else if (s.idsw > 0) {
    log_idsw = std::log10(idsw);
  }
  s.motal = ratio(tp - fp - log_idsw, tp + fn);
}

}  // namespace

ClearScores clear_mot(const SequenceSimilarities& sequence, Compat compat, ClearMatches* matches) {
  if (compat == Compat::trackeval &&
      (sequence.num_result_dets() == 0 || sequence.num_gt_dets() == 0)) {
    if (matches != nullptr) matches->assign(sequence.frames.size(), {});
    ClearScores scores;
    scores.clr_fn = sequence.num_gt_dets();
    scores.clr_fp = sequence.num_result_dets();
    scores.ml = sequence.num_gt_ids;
    scores.mlr = 1;
    return scores;
  }
  ClearScores scores = Counter(sequence, compat).count(matches);
  take_ratios(scores, compat);
  return scores;
}

ClearScores combine(std::span<const ClearScores> sequences, Compat compat) {
  ClearScores sum;
  for (const auto& s : sequences) {
    sum.clr_tp += s.clr_tp;
    sum.clr_fn += s.clr_fn;
    sum.clr_fp += s.clr_fp;
    sum.idsw += s.idsw;
    sum.mt += s.mt;
    sum.pt += s.pt;
    sum.ml += s.ml;
    sum.frag += s.frag;
    sum.clr_frames += s.clr_frames;
    sum.motp_sum += s.motp_sum;
  }
  take_ratios(sum, compat);
  return sum;
}

}  // namespace sdmt::eval
