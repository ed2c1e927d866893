// SPDX-License-Identifier: Apache-2.0
#include "evaluation/evaluation.h"

#include <fmt/format.h>

#include "cli/text_table.h"

namespace sdmt::tools {

using nlohmann::ordered_json;

namespace {

constexpr const char* kCombined = "COMBINED";

ordered_json fields_json(const eval::Scores& scores, std::int64_t idsw_trackeval,
                         std::int64_t idsw_devkit) {
  ordered_json fields;
  for (const auto& field : eval::score_fields(scores)) {
    std::visit([&](const auto value) { fields[std::string(field.name)] = value; }, field.value);
  }
  fields["IDSW_trackeval"] = idsw_trackeval;
  fields["IDSW_devkit"] = idsw_devkit;
  for (const auto& field : eval::alpha_fields(scores)) {
    std::visit([&](const auto* values) { fields["per_alpha"][std::string(field.name)] = *values; },
               field.values);
  }
  return fields;
}

// A text as one cell of CSV (RFC 4180).
std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string cell = "\"";
  for (const char c : text) cell += c == '"' ? std::string("\"\"") : std::string(1, c);
  return cell + "\"";
}

std::string csv_row(const std::string& name, const eval::Scores& scores) {
  std::string row = csv_cell(name);
  for (const auto& field : eval::score_fields(scores)) {
    std::visit([&](const auto value) { row += fmt::format(",{}", value); }, field.value);
  }
  return row + "\n";
}

std::string percent(double fraction) { return fmt::format("{:.2f}", 100 * fraction); }

std::vector<std::string> table_row(const std::string& name, const eval::Scores& scores,
                                   std::int64_t other_idsw, bool both_idsw) {
  const auto& c = scores.clear;
  const auto count = [](std::int64_t value) { return std::to_string(value); };
  std::vector<std::string> cells{name,
                                 percent(eval::mean(scores.hota.hota)),
                                 percent(eval::mean(scores.hota.deta)),
                                 percent(eval::mean(scores.hota.assa)),
                                 percent(c.mota),
                                 percent(c.motp),
                                 percent(scores.identity.idf1),
                                 percent(scores.identity.idp),
                                 percent(scores.identity.idr),
                                 percent(c.clr_re),
                                 percent(c.clr_pr),
                                 count(c.clr_fp),
                                 count(c.clr_fn),
                                 count(c.idsw)};
  if (both_idsw) cells.push_back(count(other_idsw));
  for (const auto value : {c.frag, c.mt, c.pt, c.ml, scores.count.gt_ids, scores.count.gt_dets,
                           scores.count.ids, scores.count.dets}) {
    cells.push_back(count(value));
  }
  return cells;
}

std::string remarks(const Evaluation& evaluation) {
  std::int64_t removed = 0;
  std::array<std::int64_t, eval::kNumCategories + 1> uncounted{};
  for (const auto& sequence : evaluation.sequences) {
    removed += sequence.prepared.removed_results;
    for (std::size_t i = 0; i < uncounted.size(); ++i) {
      uncounted[i] += sequence.prepared.results_on_uncounted[i];
    }
  }
  std::string text;
  if (removed > 0) {
    text += fmt::format("{} result boxes on distractors were removed before counting.\n", removed);
  }
  std::string list;
  for (int category = 1; category <= eval::kNumCategories; ++category) {
    const auto boxes = uncounted[category];
    if (boxes == 0) continue;
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", eval::category_name(category), boxes);
    if (category == eval::kPedestrian) list += " (marked 0)";
  }
  if (!list.empty()) {
    text +=
        "Result boxes that fit ground truth which is not to be tracked, false positives by the "
        "rules: " +
        list + ".\n";
  }
  return text;
}

}  // namespace

SequenceEvaluation evaluate_sequence(const std::filesystem::path& folder,
                                     const eval::GroundTruth& gt,
                                     std::span<const mot::ResultRow> results,
                                     const std::string& result_name, eval::Benchmark benchmark,
                                     eval::Compat compat) {
  SequenceEvaluation out;
  out.folder = folder;
  out.prepared = eval::prepare_sequence(gt, results, result_name, benchmark, compat);
  out.scores = eval::score_sequence(out.prepared.similarities, compat, &out.matches);
  const bool devkit = compat == eval::Compat::devkit;
  const auto other = devkit ? eval::Compat::trackeval : eval::Compat::devkit;
  const auto other_idsw = eval::clear_mot(out.prepared.similarities, other).idsw;
  out.idsw_trackeval = devkit ? other_idsw : out.scores.clear.idsw;
  out.idsw_devkit = devkit ? out.scores.clear.idsw : other_idsw;
  return out;
}

void combine_sequences(Evaluation& evaluation) {
  std::vector<eval::Scores> scores;
  evaluation.idsw_trackeval = 0;
  evaluation.idsw_devkit = 0;
  for (const auto& sequence : evaluation.sequences) {
    scores.push_back(sequence.scores);
    evaluation.idsw_trackeval += sequence.idsw_trackeval;
    evaluation.idsw_devkit += sequence.idsw_devkit;
  }
  evaluation.combined = eval::combine(scores, evaluation.compat);
}

ordered_json to_json(const Evaluation& evaluation) {
  ordered_json json;
  json["benchmark"] = eval::to_string(evaluation.benchmark);
  json["compat"] = eval::to_string(evaluation.compat);
  json["alphas"] = eval::hota_alphas();
  json["sequences"] = ordered_json::object();
  for (const auto& sequence : evaluation.sequences) {
    json["sequences"][sequence.prepared.name] =
        fields_json(sequence.scores, sequence.idsw_trackeval, sequence.idsw_devkit);
  }
  json["combined"] =
      fields_json(evaluation.combined, evaluation.idsw_trackeval, evaluation.idsw_devkit);
  return json;
}

std::string to_csv(const Evaluation& evaluation) {
  std::string text = "sequence";
  for (const auto& field : eval::score_fields(evaluation.combined)) {
    text += "," + std::string(field.name);
  }
  text += "\n";
  for (const auto& sequence : evaluation.sequences) {
    text += csv_row(sequence.prepared.name, sequence.scores);
  }
  return text + csv_row(kCombined, evaluation.combined);
}

std::string to_text(const Evaluation& evaluation) {
  const bool devkit = evaluation.compat == eval::Compat::devkit;
  bool both_idsw = false;
  for (const auto& sequence : evaluation.sequences) {
    both_idsw = both_idsw || sequence.idsw_trackeval != sequence.idsw_devkit;
  }
  std::vector<std::string> header{"sequence", "HOTA", "DetA", "AssA", "MOTA", "MOTP", "IDF1",
                                  "IDP",      "IDR",  "Rcll", "Prcn", "FP",   "FN",   "IDs"};
  if (both_idsw) header.emplace_back(devkit ? "IDs(TrackEval)" : "IDs(devkit)");
  header.insert(header.end(), {"Frag", "MT", "PT", "ML", "GT_IDs", "GT_Dets", "IDs_out", "Dets"});
  TextTable table(header);
  const auto other = [&](std::int64_t trackeval, std::int64_t of_devkit) {
    return devkit ? trackeval : of_devkit;
  };
  for (const auto& s : evaluation.sequences) {
    table.add_row(
        table_row(s.prepared.name, s.scores, other(s.idsw_trackeval, s.idsw_devkit), both_idsw));
  }
  table.add_rule();
  table.add_row(table_row(kCombined, evaluation.combined,
                          other(evaluation.idsw_trackeval, evaluation.idsw_devkit), both_idsw));
  return table.str() + remarks(evaluation);
}

}  // namespace sdmt::tools
