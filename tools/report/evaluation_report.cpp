// SPDX-License-Identifier: Apache-2.0
#include "report/evaluation_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "report/event_report.h"
#include "report/svg_plot.h"
#include "report/track_timeline.h"

namespace sdmt::tools {

namespace {

std::string percent(double fraction) { return fmt::format("{:.1f}", 100 * fraction); }

std::vector<std::string> sequence_row(const std::string& name, const eval::Scores& s) {
  const auto& c = s.clear;
  std::vector<std::string> row{name};
  for (const double score :
       {eval::mean(s.hota.hota), eval::mean(s.hota.deta), eval::mean(s.hota.assa), c.mota,
        s.identity.idf1, c.clr_re, c.clr_pr}) {
    row.push_back(percent(score));
  }
  for (const auto count :
       {c.clr_fp, c.clr_fn, c.idsw, c.frag, c.mt, c.ml, s.count.gt_ids, s.count.ids}) {
    row.push_back(std::to_string(count));
  }
  return row;
}

SvgPlot alpha_plot(const std::string& title,
                   std::initializer_list<std::pair<const char*, const eval::AlphaScores*>> lines) {
  SvgPlotOptions options;
  options.title = title;
  options.x.label = "localisation threshold";
  options.y.percent = true;
  options.legend = LegendCorner::bottom_left;
  SvgPlot plot(std::move(options));
  const auto alphas = eval::hota_alphas();
  for (const auto& [name, scores] : lines) {
    std::vector<SvgPoint> points;
    for (std::size_t a = 0; a < alphas.size(); ++a) points.push_back({alphas[a], (*scores)[a]});
    plot.add_line(name, points);
  }
  return plot;
}

void add_alpha_plots(HtmlReport& report, const eval::HotaScores& hota) {
  const std::vector<SvgPlot> panels{
      alpha_plot("HOTA and its parts", {{"HOTA", &hota.hota},
                                        {"DetA: detection", &hota.deta},
                                        {"AssA: association", &hota.assa},
                                        {"LocA: localisation", &hota.loca}}),
      alpha_plot("Recall and precision of both", {{"DetRe", &hota.detre},
                                                  {"DetPr", &hota.detpr},
                                                  {"AssRe", &hota.assre},
                                                  {"AssPr", &hota.asspr}})};
  report.add_plots(panels,
                   "How strictly boxes must fit before they count. Detection falls where boxes are "
                   "loose; association falls with it and with every change of identity.");
}

void add_events(HtmlReport& report, const Evaluation& evaluation,
                const eval::EventOptions& options) {
  constexpr std::size_t kMost = 60;
  HtmlTable table;
  table.header = {"Sequence", "Frames", "Event", "Person", "Result", "What"};
  std::size_t count = 0;
  for (const auto& sequence : evaluation.sequences) {
    for (const auto& event : eval::find_events(sequence.prepared, sequence.matches, options)) {
      if (++count > kMost) continue;
      const auto id = [](int value) { return value < 0 ? std::string() : std::to_string(value); };
      table.rows.push_back({sequence.prepared.name, frames_text(event),
                            std::string(eval::to_string(event.kind)), id(event.gt_id),
                            id(event.result_id), describe(event)});
    }
  }
  report.add_heading("Where the score was lost");
  if (count == 0) {
    report.add_paragraph("No identity switch, long miss or false track.");
    return;
  }
  table.caption = fmt::format(
      "{} of {} events. A long miss is {} boxes on end or more; a false track is matched in less "
      "than {:.0f} % of its boxes. sdmt evaluate --explain lists them all, --render draws them.",
      std::min(count, kMost), count, options.long_miss, 100 * options.false_track_match);
  report.add_table(table);
}

SvgPlot score_bars(std::span<const NamedScores> groups) {
  std::vector<double> mota, idf1, hota;
  SvgPlotOptions options;
  // As wide as its names need; what is wider than the other plots is scrolled on small screens.
  constexpr int kGroup = 72, kBeside = 110, kNarrowest = 460, kWidest = 936;
  const int count = static_cast<int>(groups.size());
  options.width = std::clamp(kBeside + kGroup * count, kNarrowest, kWidest);
  options.height = 300;
  options.legend = LegendCorner::top_right;
  constexpr double kAxisLabels = 74, kLegend = 90;  // pixels
  options.x.low = 0;
  options.x.high = count * (1 + kLegend / (options.width - kAxisLabels - kLegend));
  options.y.percent = true;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    // A bar cannot go below the axis; the table has the number.
    mota.push_back(std::max(0.0, groups[i].scores->clear.mota));
    idf1.push_back(groups[i].scores->identity.idf1);
    hota.push_back(eval::mean(groups[i].scores->hota.hota));
    options.x.ticks.push_back(static_cast<double>(i) + 0.5);
    options.x.tick_labels.push_back(groups[i].name);
  }
  SvgPlot plot(std::move(options));
  plot.add_bars("MOTA", 0.14, 1, 0.22, mota);
  plot.add_bars("IDF1", 0.39, 1, 0.22, idf1);
  plot.add_bars("HOTA", 0.64, 1, 0.22, hota);
  return plot;
}

}  // namespace

void add_sequence_table(HtmlReport& report, const Evaluation& evaluation) {
  HtmlTable table;
  table.header = {"Sequence", "HOTA", "DetA", "AssA", "MOTA", "IDF1", "Rcll",   "Prcn",
                  "FP",       "FN",   "IDs",  "Frag", "MT",   "ML",   "People", "Tracks"};
  for (const auto& sequence : evaluation.sequences) {
    table.rows.push_back(sequence_row(sequence.prepared.name, sequence.scores));
  }
  table.strong_rows = {table.rows.size()};
  table.rows.push_back(sequence_row("All", evaluation.combined));
  table.caption =
      "Ratios in per cent. MOTA, recall and precision at IoU 0.5; HOTA, DetA and AssA are means "
      "over "
      "the localisation thresholds 0.05 to 0.95.";
  report.add_table(table);
}

void add_score_bars(HtmlReport& report, std::span<const NamedScores> groups) {
  constexpr int kAPhone = 600;
  const SvgPlot plot = score_bars(groups);
  plot.options().width < kAPhone ? report.add_plots({&plot, 1}) : report.add_svg(plot.str());
}

void add_timelines(HtmlReport& report, const Evaluation& evaluation) {
  for (const auto& sequence : evaluation.sequences) {
    report.add_heading("Tracks over time: " + sequence.prepared.name);
    report.add_svg(
        track_timeline_svg(sequence),
        "A row for each person: grey while they are there and missed, coloured by result "
        "id while they are followed. Red marks an identity switch.");
  }
}

std::string evaluation_html(const Evaluation& evaluation, const std::string& results,
                            const eval::EventOptions& events) {
  const auto& all = evaluation.combined;
  HtmlReport report(
      fmt::format("{} evaluation", eval::to_string(evaluation.benchmark)),
      fmt::format("{} · {} sequence{}, {} frames, {} people in {} boxes · counted as {}", results,
                  evaluation.sequences.size(), evaluation.sequences.size() == 1 ? "" : "s",
                  all.count.frames, all.count.gt_ids, all.count.gt_dets,
                  evaluation.compat == eval::Compat::devkit ? "the MATLAB devkit" : "TrackEval"));
  const bool both = evaluation.idsw_trackeval != evaluation.idsw_devkit;
  const bool devkit = evaluation.compat == eval::Compat::devkit;
  const std::vector<HtmlNumber> numbers{
      {percent(eval::mean(all.hota.hota)), "HOTA",
       fmt::format("DetA {}, AssA {}", percent(eval::mean(all.hota.deta)),
                   percent(eval::mean(all.hota.assa)))},
      {percent(all.clear.mota), "MOTA",
       fmt::format("recall {}, precision {}", percent(all.clear.clr_re),
                   percent(all.clear.clr_pr))},
      {percent(all.identity.idf1), "IDF1",
       fmt::format("recall {}, precision {}", percent(all.identity.idr),
                   percent(all.identity.idp))},
      {std::to_string(all.clear.idsw), "Identity switches",
       both ? fmt::format("{} as {} counts",
                          devkit ? evaluation.idsw_trackeval : evaluation.idsw_devkit,
                          devkit ? "TrackEval" : "the devkit")
            : "by either way of counting"},
      {fmt::format("{} / {}", all.clear.clr_fp, all.clear.clr_fn), "False / missed boxes",
       fmt::format("of {} found, {} to find", all.count.dets, all.count.gt_dets)}};
  report.add_numbers(numbers);
  report.add_heading("Sequences");
  add_sequence_table(report, evaluation);
  std::vector<NamedScores> groups;
  for (const auto& sequence : evaluation.sequences) {
    groups.push_back({sequence.prepared.name, &sequence.scores});
  }
  if (groups.size() > 1) add_score_bars(report, groups);
  report.add_heading("HOTA over localisation");
  add_alpha_plots(report, all.hota);
  add_timelines(report, evaluation);
  add_events(report, evaluation, events);
  return report.str();
}

}  // namespace sdmt::tools
