// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "ablation/ablation.h"
#include "evaluation/scoring_arguments.h"
#include "report/evaluation_report.h"
#include "report/html_report.h"
#include "report/svg_plot.h"

namespace sdmt::tools {

namespace {

std::string percent(double fraction) { return fmt::format("{:.1f}", 100 * fraction); }

std::string rate(double fps) { return fmt::format("{:.{}f}", fps, fps < 100 ? 1 : 0); }

// Ours and, beside them, the paper's figures.
HtmlTable result_table(const AblationRun& run, const AblationRow* best) {
  HtmlTable table;
  table.header = {"Variant", "MOTA",       "FP", "FN", "IDs", "FPS", "IDF1",
                  "HOTA",    "Paper MOTA", "FP", "FN", "IDs", "FPS"};
  std::string skipped;
  for (const auto& row : run.rows) {
    std::vector<std::string> cells{row.variant.name};
    if (row.skipped.empty()) {
      const auto& s = row.evaluation.combined;
      cells.insert(cells.end(),
                   {percent(s.clear.mota), std::to_string(s.clear.clr_fp),
                    std::to_string(s.clear.clr_fn), std::to_string(s.clear.idsw), rate(row.fps),
                    percent(s.identity.idf1), percent(eval::mean(s.hota.hota))});
    } else {
      cells.insert(cells.end(), 7, "–");
      skipped = " A dash: the row " + row.skipped + ".";
    }
    if (const auto& paper = row.variant.paper) {
      cells.insert(cells.end(),
                   {percent(paper->mota), std::to_string(paper->fp), std::to_string(paper->fn),
                    std::to_string(paper->ids), rate(paper->fps)});
    } else {
      cells.insert(cells.end(), 5, "");
    }
    if (&row == best) table.strong_rows.push_back(table.rows.size());
    table.rows.push_back(std::move(cells));
  }
  table.caption =
      "Ratios in per cent. FPS is the tracker with embedding, without reading, decoding and "
      "detecting, on this machine. Bold: the best HOTA. The paper's figures are for the MOT16 "
      "training sequences with the public DPM detections, counted by the devkit of 2018: other "
      "sequences and detections give other numbers, so compare how the rows differ." +
      skipped;
  return table;
}

}  // namespace

std::string ablation_html(const AblationRun& run) {
  const AblationRow* best = nullptr;
  std::vector<NamedScores> groups;
  for (const auto& row : run.rows) {
    if (!row.skipped.empty()) continue;
    groups.push_back({row.variant.short_name, &row.evaluation.combined});
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
  HtmlReport report("Ablation",
                    fmt::format("{} · {} · {} rules, counted as {}", names, run.detections,
                                eval::to_string(run.benchmark), counted_as(run.compat)));
  report.add_heading("Variants");
  report.add_table(result_table(run, best));
  if (best != nullptr) {
    add_score_bars(report, groups);
    report.add_heading("HOTA over localisation");
    SvgPlotOptions options;
    options.x.label = "localisation threshold";
    options.y.percent = true;
    options.legend = LegendCorner::bottom_left;
    SvgPlot plot(std::move(options));
    const auto alphas = eval::hota_alphas();
    for (std::size_t i = 0; i < groups.size(); ++i) {
      std::vector<SvgPoint> points;
      for (std::size_t a = 0; a < alphas.size(); ++a) {
        points.push_back({alphas[a], groups[i].scores->hota.hota[a]});
      }
      plot.add_line(groups[i].name, points);
    }
    report.add_plots({&plot, 1});
  }
  if (best != nullptr) {
    report.add_heading("The best row in detail: " + best->variant.name);
    add_sequence_table(report, best->evaluation);
    add_timelines(report, best->evaluation);
  }
  return report.str();
}

}  // namespace sdmt::tools
