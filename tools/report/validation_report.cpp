// SPDX-License-Identifier: Apache-2.0
#include "report/validation_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "report/html_report.h"
#include "report/svg_plot.h"
#include "sdmt/media/image_file.h"
#include "synth/jpeg.h"

namespace sdmt::tools {

namespace {

constexpr const char* kSameColor = "#1d4ed8";
constexpr const char* kOtherColor = "#c2410c";

std::vector<SvgPoint> rates(const reid::Roc& roc) {
  std::vector<SvgPoint> points;
  for (const auto& p : roc.points()) points.push_back({p.fpr, p.tpr});
  return points;
}

SvgPlot roc_plot(const ValidationScores& scores, bool logarithmic, const std::string& of) {
  SvgPlotOptions options;
  options.title = (logarithmic ? "ROC at low false positive rates" : "ROC") + of;
  options.x = {"false positive rate", logarithmic ? 1e-4 : 0.0, 1, logarithmic};
  options.y = {"true positive rate", 0, 1};
  options.legend = logarithmic ? LegendCorner::none : LegendCorner::bottom_right;
  SvgPlot plot(std::move(options));
  const auto add = [&](const std::string& name, const ValidatedCurve& curve) {
    const reid::Roc& roc = curve.pairs.roc;
    const auto label = fmt::format("{}  AUC {:.3f}", name, roc.auc());
    plot.add_line(label, rates(roc));
  };
  const ContenderScores& model = scores.contenders.front();
  add(model.name, model.person_only);
  add("paper mix", model.paper);
  for (std::size_t f = 1; f < scores.contenders.size(); ++f) {
    add(scores.contenders[f].name, scores.contenders[f].person_only);
  }
  return plot;
}

SvgPlot histogram_plot(const ValidationScores& scores, const std::string& of) {
  constexpr int kBins = 80;
  const reid::Roc& roc = scores.contenders.front().person_only.pairs.roc;
  const auto histogram = reid::distance_histogram(roc, kBins);
  const double highest =
      std::max(*std::max_element(histogram.positives.begin(), histogram.positives.end()),
               *std::max_element(histogram.negatives.begin(), histogram.negatives.end()));
  SvgPlotOptions options;
  options.title = "Distances" + of;
  options.x = {"distance d of two embeddings", 0, kBins * histogram.bin_width};
  options.y = {"share of the pairs", 0, 1.15 * highest, false, true};
  options.legend = LegendCorner::top_left;
  SvgPlot plot(std::move(options));
  const double w = histogram.bin_width;
  plot.add_bars("one person", 0, w, w, histogram.positives, kSameColor);
  plot.add_bars("two people", 0, w, w, histogram.negatives, kOtherColor);
  plot.add_vertical_line(1 - scores.chosen.tau_a,
                         fmt::format("tau_a = {:.3f}", scores.chosen.tau_a));
  return plot;
}

// What every threshold would do, around the range where it matters.
SvgPlot threshold_plot(const ValidationScores& scores, const std::string& of) {
  const reid::Roc& roc = scores.contenders.front().person_only.pairs.roc;
  std::vector<SvgPoint> right;
  std::vector<SvgPoint> wrong;
  std::vector<SvgPoint> accuracy;
  for (const auto& p : roc.points()) {
    const double tau_a = 1 - p.threshold;
    right.push_back({tau_a, p.tpr});
    wrong.push_back({tau_a, p.fpr});
    accuracy.push_back({tau_a, 0.5 * (p.tpr + 1 - p.fpr)});
  }
  SvgPlotOptions options;
  options.title = "Choosing tau_a" + of;
  options.x = {"tau_a: the same person when 1 - d is larger", right.back().x, 1};
  options.y = {"rate", 0, 1.1};  // room for the threshold's label
  options.legend = LegendCorner::bottom_left;
  SvgPlot plot(std::move(options));
  plot.add_line("true positives", right, kSameColor);
  plot.add_line("false positives", wrong, kOtherColor);
  plot.add_line("accuracy", accuracy, "#0f766e");
  plot.add_vertical_line(scores.chosen.tau_a, fmt::format("{:.3f}, by {}", scores.chosen.tau_a,
                                                          scores.chosen.criterion));
  return plot;
}

std::vector<SvgPlot> panels(const ValidationScores& scores, const std::string& of) {
  return {roc_plot(scores, false, of), roc_plot(scores, true, of), histogram_plot(scores, of),
          threshold_plot(scores, of)};
}

void add_summary(HtmlReport& report, const ValidationScores& scores) {
  const ContenderScores& model = scores.contenders.front();
  const ValidatedCurve& curve = model.person_only;
  const reid::Roc& roc = curve.pairs.roc;
  std::vector<HtmlNumber> numbers = {
      {fmt::format("{:.3f}", roc.auc()), "AUC",
       fmt::format("95 %: {:.3f} to {:.3f}", curve.intervals.auc.low, curve.intervals.auc.high)},
      {fmt::format("{:.3f}", roc.eer()), "equal error rate", "lower is better"},
      {fmt::format("{:.3f}", roc.tpr_at_fpr(0.01)), "TPR at FPR 1 %", "pairs recognised"}};
  if (model.search) {
    numbers.push_back({fmt::format("{:.3f}", model.search->rank1), "rank-1",
                       fmt::format("{} queries", format_count(model.search->queries))});
    numbers.push_back({fmt::format("{:.3f}", model.search->map), "mAP",
                       fmt::format("trapezoid {:.3f}", model.search->map_trapezoid)});
  }
  numbers.push_back({fmt::format("{:.3f}", scores.chosen.tau_a), "tau_a",
                     fmt::format("by {}", scores.chosen.criterion)});
  report.add_numbers(numbers);
}

std::vector<std::string> curve_cells(const std::string& name, const ValidatedCurve& curve) {
  const reid::Roc& roc = curve.pairs.roc;
  return {name,
          format_area(curve),
          format_rate(roc.eer()),
          format_rate(roc.tpr_at_fpr(0.1)),
          format_rate(roc.tpr_at_fpr(0.01)),
          format_rate(roc.tpr_at_fpr(0.001))};
}

void add_tables(HtmlReport& report, const ValidationScores& scores) {
  const ContenderScores& model = scores.contenders.front();
  report.add_heading("Telling pairs apart");
  HtmlTable curves{{"", "AUC [95 %]", "EER", "TPR at FPR 0.1", "0.01", "0.001"}, {}, "", {0}};
  curves.rows.push_back(curve_cells(model.name + ", person-only", model.person_only));
  if (model.cross_camera) {
    curves.rows.push_back(curve_cells(model.name + ", across cameras", *model.cross_camera));
  }
  curves.rows.push_back(curve_cells(model.name + ", paper mix", model.paper));
  for (std::size_t f = 1; f < scores.contenders.size(); ++f) {
    curves.rows.push_back(curve_cells(scores.contenders[f].name, scores.contenders[f].person_only));
  }
  curves.caption = fmt::format(
      "Person-only pairs: {}. Paper mix, as many of each kind: {} (seed {}). Intervals: bootstrap "
      "over identities, 500 draws.",
      describe_pairs(model.person_only.pairs.counts), describe_pairs(model.paper.pairs.counts),
      scores.options.seed);
  report.add_table(curves);

  if (model.search) {
    report.add_heading("Searching a gallery");
    HtmlTable search{{"", "rank-1", "rank-5", "rank-10", "mAP", "mAP (trapezoid)"}, {}, "", {0}};
    for (const ContenderScores& contender : scores.contenders) {
      if (!contender.search) continue;
      const auto& s = *contender.search;
      search.rows.push_back({contender.name, format_rate(s.rank1), format_rate(s.rank5),
                             format_rate(s.rank10), format_rate(s.map),
                             format_rate(s.map_trapezoid)});
    }
    search.caption = fmt::format(
        "Protocol of Market-1501, single query: {} queries; images of the query's person by its "
        "own "
        "camera are passed over, background counts as wrong.",
        format_count(model.search->queries));
    report.add_table(search);
  }

  report.add_heading("Thresholds for the tracker");
  HtmlTable thresholds{{"chosen by", "tau_a", "distance", "TPR", "FPR"}, {}, "", {}};
  for (const ThresholdChoice& t : scores.thresholds) {
    if (t.criterion == scores.chosen.criterion) {
      thresholds.strong_rows.push_back(thresholds.rows.size());
    }
    thresholds.rows.push_back({t.criterion, format_rate(t.tau_a), format_rate(1 - t.tau_a),
                               format_rate(t.tpr), format_rate(t.fpr)});
  }
  thresholds.caption =
      "Two crops count as one person when 1 - d exceeds tau_a. Rates on the person-only pairs.";
  report.add_table(thresholds);

  HtmlTable rates{rates_header(scores.options), {}, "", {}};
  rates.header.insert(rates.header.begin(), "");
  for (const ContenderScores& contender : scores.contenders) {
    rates.rows.push_back(rates_cells(contender, scores.options));
    rates.rows.back().insert(rates.rows.back().begin(), contender.name);
  }
  rates.caption =
      "What the threshold stored with the model does here, and the one that this data would need.";
  report.add_table(rates);
}

// The crop as the network sees it: stretched to one shape.
std::string picture(const ValidationCrop& crop) {
  const auto image = media::read_image(crop.image);
  const image::PixelRect whole{0, 0, static_cast<double>(image.width),
                               static_cast<double>(image.height)};
  const auto region =
      image::visible_region(image.width, image.height, crop.rect.value_or(whole)).value();
  const cv::Mat all(image.height, image.width, CV_8UC3,
                    const_cast<std::uint8_t*>(image.bgr.data()));  // only read
  cv::Mat part;
  cv::resize(all(cv::Rect(region.left, region.top, region.width(), region.height())), part,
             {96, 192}, 0, 0, cv::INTER_AREA);
  constexpr int kQuality = 85;
  return data_uri("image/jpeg", encode_jpeg(part, kQuality));
}

std::vector<HtmlCard> cards(const std::vector<reid::ImagePair>& pairs,
                            const std::vector<ValidationCrop>& crops) {
  std::vector<HtmlCard> result;
  for (const auto& pair : pairs) {
    const auto& a = crops[pair.first];
    const auto& b = crops[pair.second];
    result.push_back({{picture(a), picture(b)},
                      fmt::format("d = {:.3f}", pair.distance),
                      a.label() + "\n" + b.label()});
  }
  return result;
}

void add_set(HtmlReport& report, const ValidationScores& scores, const DescribedCrops& described) {
  add_summary(report, scores);
  report.add_heading("Curves");
  report.add_plots(
      panels(scores, ""),
      "All curves on the person-only pairs, but that of the paper mix. Histograms have equal "
      "mass.");
  add_tables(report, scores);

  constexpr std::size_t kMistakes = 12;
  const auto hardest = reid::hardest_pairs(described.rows.front(), kMistakes);
  report.add_heading("One person, taken for two");
  report.add_paragraph(
      "The pairs of one person that lie farthest apart, at most one a person. Wrong labels and "
      "bad boxes show up here first.");
  report.add_gallery(cards(hardest.positives, described.crops));
  report.add_heading("Two people, taken for one");
  report.add_paragraph("The pairs of two people that lie nearest, at most one a pair of people.");
  report.add_gallery(cards(hardest.negatives, described.crops));
}

}  // namespace

std::string validation_plot(std::span<const ValidationScores> sets) {
  std::vector<SvgPlot> all;
  for (const ValidationScores& scores : sets) {
    for (SvgPlot& panel : panels(scores, sets.size() > 1 ? ", " + scores.data : "")) {
      all.push_back(std::move(panel));
    }
  }
  return svg_figure(all, 2);
}

std::string validation_report(std::span<const ValidationScores> sets,
                              std::span<const DescribedCrops> described, const std::string& model) {
  std::string subtitle = model + " on ";
  for (const ValidationScores& scores : sets) {
    if (&scores != &sets.front()) subtitle += "; ";
    subtitle += fmt::format("{}: {}", scores.data, describe_images(scores));
  }
  HtmlReport report("Validation of the embedder", subtitle);
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (sets.size() > 1) report.add_heading(sets[i].data);
    add_set(report, sets[i], described[i]);
  }
  return report.str();
}

}  // namespace sdmt::tools
