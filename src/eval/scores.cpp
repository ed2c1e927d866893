// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/scores.h"

namespace sdmt::eval {

namespace {

template <typename Part>
std::vector<Part> collect(std::span<const Scores> sequences, Part Scores::*part) {
  std::vector<Part> parts;
  parts.reserve(sequences.size());
  for (const auto& scores : sequences) parts.push_back(scores.*part);
  return parts;
}

}  // namespace

Scores score_sequence(const SequenceSimilarities& sequence, Compat compat, ClearMatches* matches) {
  Scores scores;
  scores.clear = clear_mot(sequence, compat, matches);
  scores.identity = identity(sequence);
  scores.hota = hota(sequence);
  scores.count = {sequence.num_result_dets(), sequence.num_gt_dets(), sequence.num_result_ids,
                  sequence.num_gt_ids, static_cast<std::int64_t>(sequence.frames.size())};
  return scores;
}

Scores combine(std::span<const Scores> sequences, Compat compat) {
  Scores sum;
  sum.clear = combine(collect(sequences, &Scores::clear), compat);
  sum.identity = combine(collect(sequences, &Scores::identity));
  sum.hota = combine(collect(sequences, &Scores::hota));
  for (const auto& scores : sequences) {
    sum.count.dets += scores.count.dets;
    sum.count.gt_dets += scores.count.gt_dets;
    sum.count.ids += scores.count.ids;
    sum.count.gt_ids += scores.count.gt_ids;
    sum.count.frames += scores.count.frames;
  }
  return sum;
}

std::vector<ScoreField> score_fields(const Scores& scores) {
  const auto& c = scores.clear;
  const auto& i = scores.identity;
  const auto& h = scores.hota;
  const auto& n = scores.count;
  return {
      {"MOTA", c.mota},
      {"MOTP", c.motp},
      {"MODA", c.moda},
      {"CLR_Re", c.clr_re},
      {"CLR_Pr", c.clr_pr},
      {"MTR", c.mtr},
      {"PTR", c.ptr},
      {"MLR", c.mlr},
      {"sMOTA", c.smota},
      {"CLR_F1", c.clr_f1},
      {"FP_per_frame", c.fp_per_frame},
      {"MOTAL", c.motal},
      {"MOTP_sum", c.motp_sum},
      {"CLR_TP", c.clr_tp},
      {"CLR_FN", c.clr_fn},
      {"CLR_FP", c.clr_fp},
      {"IDSW", c.idsw},
      {"MT", c.mt},
      {"PT", c.pt},
      {"ML", c.ml},
      {"Frag", c.frag},
      {"CLR_Frames", c.clr_frames},
      {"IDF1", i.idf1},
      {"IDP", i.idp},
      {"IDR", i.idr},
      {"IDTP", i.idtp},
      {"IDFN", i.idfn},
      {"IDFP", i.idfp},
      {"HOTA", mean(h.hota)},
      {"DetA", mean(h.deta)},
      {"AssA", mean(h.assa)},
      {"DetRe", mean(h.detre)},
      {"DetPr", mean(h.detpr)},
      {"AssRe", mean(h.assre)},
      {"AssPr", mean(h.asspr)},
      {"LocA", mean(h.loca)},
      {"OWTA", mean(h.owta)},
      {"HOTA(0)", h.hota_0},
      {"LocA(0)", h.loca_0},
      {"HOTALocA(0)", h.hotaloca_0},
      {"Dets", n.dets},
      {"GT_Dets", n.gt_dets},
      {"IDs", n.ids},
      {"GT_IDs", n.gt_ids},
      {"Frames", n.frames},
  };
}

std::vector<AlphaField> alpha_fields(const Scores& scores) {
  const auto& h = scores.hota;
  return {
      {"HOTA", &h.hota},       {"DetA", &h.deta},       {"AssA", &h.assa},
      {"DetRe", &h.detre},     {"DetPr", &h.detpr},     {"AssRe", &h.assre},
      {"AssPr", &h.asspr},     {"LocA", &h.loca},       {"OWTA", &h.owta},
      {"HOTA_TP", &h.hota_tp}, {"HOTA_FN", &h.hota_fn}, {"HOTA_FP", &h.hota_fp},
  };
}

}  // namespace sdmt::eval
