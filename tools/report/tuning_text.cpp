// SPDX-License-Identifier: Apache-2.0
#include "report/tuning_text.h"

#include <fmt/format.h>

#include "cli/text_table.h"

namespace sdmt::tools {

namespace {

std::string percent(double fraction) { return fmt::format("{:.1f}", 100 * fraction); }

std::string signed_percent(double fraction) { return fmt::format("{:+.1f}", 100 * fraction); }

std::string gain_text(double gain, double error) {
  return fmt::format("{} ({})", signed_percent(gain), percent(error));
}

std::string pair_text(const tuning::SequenceScores& scores) {
  return percent(scores.mota) + " / " + percent(scores.idf1);
}

std::string scores_table(const tuning::TuningResult& result) {
  TextTable table(
      {"options", "MOTA", "IDF1", "all boxes: MOTA", "IDF1", "over base: MOTA", "IDF1"});
  const auto add = [&](const char* name, const tuning::ChoiceScores& choice) {
    const auto& [scores, gain] = choice;
    table.add_row({name, percent(scores.mean_mota), percent(scores.mean_idf1),
                   percent(scores.pooled_mota), percent(scores.pooled_idf1),
                   gain_text(gain.mota, gain.mota_error), gain_text(gain.idf1, gain.idf1_error)});
  };
  add("base", result.base);
  add("chosen on all (in sample)", result.in_sample);
  add("chosen without the sequence (held out)", result.held_out);
  add("ByteTrack, smoothed and filled as base", result.bytetrack);
  return table.str();
}

std::string options_table(const tuning::TuningResult& result) {
  TextTable table({"option", "base", "chosen", "worth in sample", "held out"});
  for (const tuning::OptionWorth& each : result.options) {
    table.add_row({each.option, each.base, each.chosen, signed_percent(each.in_sample),
                   signed_percent(each.held_out)});
  }
  return table.str();
}

std::string sequences_table(const tuning::TuningResult& result) {
  TextTable table({"sequence", "detections", "held out", "base", "ByteTrack", "chosen without it"},
                  {1, 5});
  for (const tuning::HeldOutSequence& row : result.sequences) {
    std::string chosen;
    for (std::size_t i = 0; i < row.chosen.size(); ++i) {
      chosen += fmt::format("{}{} {}", i == 0 ? "" : ", ", result.options[i].option, row.chosen[i]);
    }
    table.add_row({row.sequence, row.detections, pair_text(row.held_out), pair_text(row.base),
                   pair_text(row.bytetrack), chosen});
  }
  return table.str();
}

}  // namespace

std::string tuning_text(const tuning::TuningResult& result) {
  return fmt::format("{} sequences, {} settings, {} draws\n", result.sequences.size(),
                     result.settings, result.draws) +
         scores_table(result) +
         "means over sequences and draws; in brackets the standard error over sequences\n\n" +
         options_table(result) + "in points of MOTA + IDF1\n\n" + sequences_table(result) +
         "MOTA / IDF1\n";
}

}  // namespace sdmt::tools
