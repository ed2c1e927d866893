// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "ablation/ablation.h"
#include "evaluation/evaluation_report.h"
#include "html_report.h"
#include "svg_plot.h"

namespace sdmt::tools {

namespace {

std::string percent(double fraction) { return fmt::format("{:.1f}", 100 * fraction); }

HtmlTable result_table(const AblationRun& run, const AblationRow* best) {
  HtmlTable table;
  table.header = {"Variant", "MOTA", "FP", "FN", "IDs", "FPS", "IDF1", "HOTA", "DetA", "AssA"};
  std::string skipped;
  for (const auto& row : run.rows) {
    std::vector<std::string> cells{row.variant.name};
    if (row.skipped.empty()) {
      const auto& s = row.evaluation.combined;
      cells.insert(cells.end(), {percent(s.clear.mota), std::to_string(s.clear.clr_fp),
                                 std::to_string(s.clear.clr_fn), std::to_string(s.clear.idsw),
                                 fmt::format("{:.1f}", row.fps), percent(s.identity.idf1),
                                 percent(eval::mean(s.hota.hota)), percent(eval::mean(s.hota.deta)),
                                 percent(eval::mean(s.hota.assa))});
    } else {
      cells.insert(cells.end(), 9, "–");
      skipped = " A dash: the row " + row.skipped + ".";
    }
    if (&row == best) table.strong_rows.push_back(table.rows.size());
    table.rows.push_back(std::move(cells));
  }
  table.caption =
      "Ratios in per cent; FPS is the tracker with embedding, without reading, decoding and "
      "detecting, on this machine. Bold: the best HOTA." +
      skipped;
  return table;
}

HtmlTable paper_table(const AblationRun& run) {
  HtmlTable table;
  table.header = {"Variant", "MOTA", "FP", "FN", "IDs", "FPS"};
  for (const auto& row : run.rows) {
    const auto& paper = row.variant.paper;
    if (!paper) continue;
    table.rows.push_back({row.variant.name, percent(paper->mota), std::to_string(paper->fp),
                          std::to_string(paper->fn), std::to_string(paper->ids),
                          fmt::format("{:.1f}", paper->fps)});
  }
  table.caption =
      "The paper's own table: MOT16 training sequences, public DPM detections, the devkit of 2018. "
      "Other sequences and detections give other numbers; compare how the rows differ.";
  return table;
}

}  // namespace

std::string ablation_html(const AblationRun& run) {
  const AblationRow* best = nullptr;
  std::vector<NamedScores> groups;
  for (const auto& row : run.rows) {
    if (!row.skipped.empty()) continue;
    groups.push_back({row.variant.name, &row.evaluation.combined});
    const auto hota = [](const AblationRow& r) {
      return eval::mean(r.evaluation.combined.hota.hota);
    };
    if (best == nullptr || hota(row) > hota(*best)) best = &row;
  }
  std::string names;
  if (best != nullptr) {
    for (const auto& sequence : best->evaluation.sequences) {
      names += (names.empty() ? "" : ", ") + sequence.prepared.name;
    }
  }
  HtmlReport report("Ablation", fmt::format("{} · {} · {} rules, counted as {}", names,
                                            run.detections, eval::to_string(run.benchmark),
                                            run.compat == eval::Compat::devkit ? "the MATLAB devkit"
                                                                               : "TrackEval"));
  report.add_heading("Variants");
  report.add_table(result_table(run, best));
  if (best != nullptr) {
    report.add_svg(score_bars_svg(groups));
    report.add_heading("HOTA over localisation");
    SvgPlotOptions options;
    options.width = 936;
    options.x.label = "localisation threshold";
    options.y.percent = true;
    options.legend = LegendCorner::top_right;
    SvgPlot plot(std::move(options));
    const auto alphas = eval::hota_alphas();
    for (std::size_t i = 0; i < groups.size(); ++i) {
      std::vector<SvgPoint> points;
      for (std::size_t a = 0; a < alphas.size(); ++a) {
        points.push_back({alphas[a], groups[i].scores->hota.hota[a]});
      }
      plot.add_line(groups[i].name, points, "", i >= 6);  // the paper's six full, ours dashed
    }
    report.add_svg(plot.str());
  }
  report.add_heading("The paper's table");
  report.add_table(paper_table(run));
  if (best != nullptr) {
    report.add_heading("The best row: " + best->variant.name);
    add_timelines(report, best->evaluation);
  }
  return report.str();
}

}  // namespace sdmt::tools
