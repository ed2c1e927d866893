// SPDX-License-Identifier: Apache-2.0
#include "validation/validation.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

#include "cli/text_table.h"
#include "sdmt/reid/camera_means.h"
#include "sdmt/reid/market1501.h"

namespace sdmt::tools {

namespace {

ValidatedCurve validated(reid::PairCurve curve, const reid::OperatingPoints& points,
                         std::uint64_t seed) {
  reid::BootstrapOptions options;
  options.seed = seed;
  const auto intervals = reid::bootstrap_curve(std::exchange(curve.pairs, {}), curve.identities,
                                               curve.backgrounds, points, options);
  return {std::move(curve), intervals};
}

// The rows of `crops` that `wanted` picks.
template <typename Wanted>
reid::LabelledEmbeddings subset(const reid::LabelledEmbeddings& all,
                                const std::vector<ValidationCrop>& crops, Wanted wanted) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < crops.size(); ++i) {
    if (wanted(crops[i])) rows.push_back(i);
  }
  reid::LabelledEmbeddings part;
  part.embeddings.resize({static_cast<int>(rows.size()), 1, 1, all.dimensions()});
  for (std::size_t r = 0; r < rows.size(); ++r) {
    std::copy_n(all.embeddings.image(static_cast<int>(rows[r])), all.dimensions(),
                part.embeddings.image(static_cast<int>(r)));
    part.pids.push_back(all.pids[rows[r]]);
    part.camids.push_back(all.camids[rows[r]]);
  }
  return part;
}

ContenderScores score_rows(const std::string& name, const reid::LabelledEmbeddings& rows,
                           const reid::PairDistance& distance, std::optional<double> tau_a,
                           const std::vector<ValidationCrop>& crops,
                           const ValidationOptions& options, const std::function<void()>& step) {
  const reid::OperatingPoints points{tau_a.value_or(0), options.target_fpr};
  const auto curve = [&](reid::PairSet set) {
    reid::PairOptions pairs;
    pairs.set = set;
    pairs.pairs = options.pairs;
    pairs.seed = options.seed;
    auto result = validated(reid::pair_curve(rows, pairs, distance), points, options.seed);
    step();
    return result;
  };
  ContenderScores scores{.name = name,
                         .person_only = curve(reid::PairSet::person_only),
                         .cross_camera = {},
                         .paper = curve(reid::PairSet::paper),
                         .search = {},
                         .stored_tau_a = tau_a};
  const auto across = reid::count_pairs(rows, reid::PairSet::cross_camera);
  if (across.positives > 0 && across.negatives > 0) {
    scores.cross_camera = curve(reid::PairSet::cross_camera);
  }
  if (distance) return scores;
  scores.search =
      reid::reid_metrics(subset(rows, crops, [](const auto& crop) { return crop.query; }),
                         subset(rows, crops, [](const auto& crop) { return crop.gallery; }));
  return scores;
}

ThresholdChoice choice(std::string criterion, double tau_a, const reid::Roc& roc) {
  const auto rates = roc.at(1.0 - tau_a);
  return {std::move(criterion), tau_a, rates.tpr, rates.fpr};
}

std::vector<ThresholdChoice> threshold_choices(const reid::Roc& roc) {
  return {choice("accuracy", roc.tau_a_max_accuracy(), roc),
          choice("eer", roc.tau_a_eer(), roc),
          choice("crossing", roc.tau_a_histogram_crossing(), roc),
          choice("fpr 0.1", roc.tau_a_at_fpr(0.1), roc),
          choice("fpr 0.01", roc.tau_a_at_fpr(0.01), roc),
          choice("fpr 0.001", roc.tau_a_at_fpr(0.001), roc)};
}

nlohmann::ordered_json curve_json(const ValidatedCurve& curve) {
  const reid::Roc& roc = curve.pairs.roc;
  return {{"auc", roc.auc()},
          {"auc_low", curve.intervals.auc.low},
          {"auc_high", curve.intervals.auc.high},
          {"eer", roc.eer()},
          {"tpr_at_fpr",
           {{"0.1", roc.tpr_at_fpr(0.1)},
            {"0.01", roc.tpr_at_fpr(0.01)},
            {"0.001", roc.tpr_at_fpr(0.001)}}},
          {"fpr_at_tpr", {{"0.7", roc.fpr_at_tpr(0.7)}, {"0.9", roc.fpr_at_tpr(0.9)}}},
          {"accuracy", roc.accuracy()},
          {"positives", curve.pairs.counts.positives},
          {"negatives", curve.pairs.counts.negatives},
          {"distractors", curve.pairs.counts.distractors}};
}

nlohmann::ordered_json contender_json(const ContenderScores& scores,
                                      const ValidationOptions& options) {
  nlohmann::ordered_json json;
  json["person_only"] = curve_json(scores.person_only);
  json["cross_camera"] = nullptr;
  if (scores.cross_camera) json["cross_camera"] = curve_json(*scores.cross_camera);
  json["paper"] = curve_json(scores.paper);
  const auto search = [&](const char* key, double reid::ReidMetrics::*field) {
    json[key] = nullptr;
    if (scores.search) json[key] = *scores.search.*field;
  };
  search("rank1", &reid::ReidMetrics::rank1);
  search("rank5", &reid::ReidMetrics::rank5);
  search("rank10", &reid::ReidMetrics::rank10);
  search("map", &reid::ReidMetrics::map);
  search("map_trapezoid", &reid::ReidMetrics::map_trapezoid);
  const ValidatedCurve& curve = scores.person_only;
  const auto with_interval = [](double value, const reid::Interval& interval) {
    return nlohmann::ordered_json{{"value", value}, {"low", interval.low}, {"high", interval.high}};
  };
  json["at_stored_tau_a"] = nullptr;
  if (scores.stored_tau_a) {
    const auto rates = curve.pairs.roc.at(1 - *scores.stored_tau_a);
    json["at_stored_tau_a"] = {{"tau_a", *scores.stored_tau_a},
                               {"tpr", with_interval(rates.tpr, curve.intervals.tpr)},
                               {"fpr", with_interval(rates.fpr, curve.intervals.fpr)}};
  }
  json["at_target_fpr"] = {{"target_fpr", options.target_fpr},
                           {"tau_a", with_interval(curve.pairs.roc.tau_a_at_fpr(options.target_fpr),
                                                   curve.intervals.tau_a)}};
  return json;
}

void add_curve_row(TextTable& table, const std::string& name, const ValidatedCurve& curve) {
  const reid::Roc& roc = curve.pairs.roc;
  table.add_row({name, format_area(curve), format_rate(roc.eer()), format_rate(roc.tpr_at_fpr(0.1)),
                 format_rate(roc.tpr_at_fpr(0.01)), format_rate(roc.tpr_at_fpr(0.001))});
}

std::string curve_table(const ValidationScores& scores) {
  TextTable table({"", "AUC [95 %]", "EER", "TPR at FPR 0.1", "0.01", "0.001"});
  const ContenderScores& model = scores.contenders.front();
  add_curve_row(table, "person-only", model.person_only);
  if (model.cross_camera) add_curve_row(table, "across cameras", *model.cross_camera);
  add_curve_row(table, "paper mix", model.paper);
  if (scores.contenders.size() > 1) table.add_rule();
  for (std::size_t f = 1; f < scores.contenders.size(); ++f) {
    add_curve_row(table, scores.contenders[f].name, scores.contenders[f].person_only);
  }
  return table.str();
}

std::string search_table(const ValidationScores& scores) {
  if (!scores.contenders.front().search) {
    return "search: no image of a query's person by another camera\n";
  }
  TextTable table({"search", "rank-1", "rank-5", "rank-10", "mAP", "mAP (trapezoid)"});
  for (const ContenderScores& contender : scores.contenders) {
    const auto& s = contender.search;
    if (!s) continue;
    table.add_row({contender.name, format_rate(s->rank1), format_rate(s->rank5),
                   format_rate(s->rank10), format_rate(s->map), format_rate(s->map_trapezoid)});
  }
  return table.str();
}

std::string threshold_table(const ValidationScores& scores) {
  TextTable table({"tau_a by", "tau_a", "TPR", "FPR"});
  for (const ThresholdChoice& t : scores.thresholds) {
    table.add_row({t.criterion, format_rate(t.tau_a), format_rate(t.tpr), format_rate(t.fpr)});
  }
  return table.str();
}

std::string rates_table(std::span<const ValidationScores> sets) {
  std::vector<std::string> header = rates_header(sets.front().options);
  header.insert(header.begin(), {"", ""});
  TextTable table(header, {1});
  for (const ValidationScores& scores : sets) {
    for (const ContenderScores& contender : scores.contenders) {
      std::vector<std::string> cells = rates_cells(contender, scores.options);
      cells.insert(cells.begin(), {scores.data, contender.name});
      table.add_row(cells);
    }
  }
  return table.str();
}

std::string comparison_table(std::span<const ValidationScores> sets) {
  TextTable table({"", "", "AUC [95 %]", "TPR at FPR 0.1", "0.01", "0.001", "rank-1", "mAP"}, {1});
  for (const ValidationScores& scores : sets) {
    for (const ContenderScores& contender : scores.contenders) {
      const reid::Roc& roc = contender.person_only.pairs.roc;
      const auto& search = contender.search;
      table.add_row({scores.data, contender.name, format_area(contender.person_only),
                     format_rate(roc.tpr_at_fpr(0.1)), format_rate(roc.tpr_at_fpr(0.01)),
                     format_rate(roc.tpr_at_fpr(0.001)), search ? format_rate(search->rank1) : "-",
                     search ? format_rate(search->map) : "-"});
    }
  }
  return table.str();
}

std::string text_of(const ValidationScores& scores) {
  const ContenderScores& model = scores.contenders.front();
  std::string text = fmt::format("{}: {}\n", scores.data, describe_images(scores));
  if (scores.unreadable > 0) {
    text += fmt::format("left out, unreadable or too small: {}\n", scores.unreadable);
  }
  text += fmt::format("pairs, person-only: {}\npairs, paper mix: {}; seed {}\n\n",
                      describe_pairs(model.person_only.pairs.counts),
                      describe_pairs(model.paper.pairs.counts), scores.options.seed);
  text += curve_table(scores) + "\n" + search_table(scores) + "\n" + threshold_table(scores) +
          "\n" + rates_table({&scores, 1});
  return text +
         fmt::format("\ntau_a = {:.4f} (by {})\n", scores.chosen.tau_a, scores.chosen.criterion);
}

nlohmann::ordered_json json_of(const ValidationScores& scores) {
  nlohmann::ordered_json json = contender_json(scores.contenders.front(), scores.options);
  json["tau_a"] = scores.chosen.tau_a;
  json["criterion"] = scores.chosen.criterion;
  nlohmann::ordered_json thresholds;
  for (const ThresholdChoice& t : scores.thresholds) {
    thresholds[t.criterion] = {{"tau_a", t.tau_a}, {"tpr", t.tpr}, {"fpr", t.fpr}};
  }
  json["tau_a_by"] = thresholds;
  json["data"] = scores.data;
  json["images"] = scores.images;
  json["people"] = scores.people;
  json["cameras"] = scores.cameras;
  json["distractor_images"] = scores.distractors;
  json["unreadable"] = scores.unreadable;
  json["seed"] = scores.options.seed;
  nlohmann::ordered_json baselines = nlohmann::ordered_json::object();
  for (std::size_t f = 1; f < scores.contenders.size(); ++f) {
    baselines[scores.contenders[f].name] = contender_json(scores.contenders[f], scores.options);
  }
  json["baselines"] = baselines;
  return json;
}

}  // namespace

void ValidationOptions::validate() const {
  reid::PairOptions pair_options;
  pair_options.pairs = pairs;
  pair_options.validate();
  if (!(target_fpr > 0 && target_fpr < 1)) {
    throw std::invalid_argument(
        fmt::format("target_fpr is {}, expected between 0 and 1", target_fpr));
  }
}

ThresholdChoice choose_threshold(const reid::Roc& roc, const std::string& criterion,
                                 double target_fpr) {
  if (criterion == "fpr") return choice("fpr", roc.tau_a_at_fpr(target_fpr), roc);
  for (ThresholdChoice& candidate : threshold_choices(roc)) {
    if (candidate.criterion == criterion) return std::move(candidate);
  }
  throw std::invalid_argument("criterion is '" + criterion +
                              "', expected accuracy, eer, crossing or fpr");
}

ValidationScores score(const DescribedCrops& described, std::span<const Contender> contenders,
                       const ValidationOptions& options, const std::string& data,
                       const std::function<void(std::int64_t)>& progress) {
  options.validate();
  ValidationScores scores;
  scores.data = data;
  scores.options = options;
  scores.unreadable = static_cast<int>(described.unreadable.size());
  std::set<int> people;
  std::set<int> cameras;
  for (const ValidationCrop& crop : described.crops) {
    if (crop.pid == reid::kDistractorPid) {
      ++scores.distractors;
      continue;
    }
    ++scores.images;
    people.insert(crop.pid);
    cameras.insert(crop.camid);
  }
  scores.people = static_cast<int>(people.size());
  scores.cameras = static_cast<int>(cameras.size());
  const auto add = [&](const std::string& name, const reid::LabelledEmbeddings& rows,
                       const reid::PairDistance& distance, std::optional<double> tau_a) {
    std::int64_t steps = kScoringSteps * static_cast<std::int64_t>(scores.contenders.size());
    scores.contenders.push_back(score_rows(name, rows, distance, tau_a, described.crops, options,
                                           [&] { progress(++steps); }));
    progress(kScoringSteps * static_cast<std::int64_t>(scores.contenders.size()));
  };
  progress(0);
  for (std::size_t f = 0; f < described.rows.size(); ++f) {
    const Contender& contender = contenders[f];
    add(contender.name, described.rows[f], contender.distance,
        contender.descriptor ? contender.descriptor->tau_a() : std::nullopt);
  }
  for (std::size_t f = 0; f < described.rows.size() && options.centre; ++f) {
    if (contenders[f].distance) continue;
    reid::LabelledEmbeddings rows = described.rows[f];
    reid::subtract_camera_means(rows.embeddings, rows.camids);
    add(contenders[f].name + ", less camera means", rows, {}, {});
  }
  const reid::Roc& roc = scores.contenders.front().person_only.pairs.roc;
  scores.thresholds = threshold_choices(roc);
  scores.chosen = choose_threshold(roc, options.criterion, options.target_fpr);
  return scores;
}

std::string format_rate(double value) { return fmt::format("{:.4f}", value); }

std::string format_interval(double value, const reid::Interval& interval) {
  return fmt::format("{:.4f} [{:.4f}, {:.4f}]", value, interval.low, interval.high);
}

std::string format_area(const ValidatedCurve& curve) {
  return format_interval(curve.pairs.roc.auc(), curve.intervals.auc);
}

std::vector<std::string> rates_header(const ValidationOptions& options) {
  return {"stored tau_a", "TPR there [95 %]", "FPR there [95 %]",
          fmt::format("tau_a for FPR {:g} [95 %]", options.target_fpr)};
}

std::vector<std::string> rates_cells(const ContenderScores& contender,
                                     const ValidationOptions& options) {
  const ValidatedCurve& curve = contender.person_only;
  std::vector<std::string> cells = {"-", "-", "-"};
  if (contender.stored_tau_a) {
    const auto rates = curve.pairs.roc.at(1 - *contender.stored_tau_a);
    cells = {format_rate(*contender.stored_tau_a), format_interval(rates.tpr, curve.intervals.tpr),
             format_interval(rates.fpr, curve.intervals.fpr)};
  }
  cells.push_back(
      format_interval(curve.pairs.roc.tau_a_at_fpr(options.target_fpr), curve.intervals.tau_a));
  return cells;
}

std::string format_count(std::int64_t value) {
  std::string digits = std::to_string(value);
  for (auto at = static_cast<std::ptrdiff_t>(digits.size()) - 3; at > 0; at -= 3) {
    digits.insert(static_cast<std::size_t>(at), ",");
  }
  return digits;
}

std::string describe_pairs(const reid::PairCounts& counts) {
  std::string text = fmt::format("{} of one person, {} of two people",
                                 format_count(counts.positives), format_count(counts.negatives));
  if (counts.distractors > 0) {
    text += fmt::format(", {} of a person and the background", format_count(counts.distractors));
  }
  return text;
}

std::string describe_images(const ValidationScores& scores) {
  auto text = fmt::format("{} images of {} people by {} camera{}", format_count(scores.images),
                          scores.people, scores.cameras, scores.cameras == 1 ? "" : "s");
  if (scores.distractors > 0) {
    text += fmt::format(", {} of the background", format_count(scores.distractors));
  }
  return text;
}

std::string to_text(std::span<const ValidationScores> sets) {
  if (sets.size() == 1) return text_of(sets.front());
  std::string text;
  for (const ValidationScores& scores : sets) {
    text += fmt::format("{}: {}", scores.data, describe_images(scores));
    if (scores.unreadable > 0) text += fmt::format("; left out: {}", scores.unreadable);
    text += '\n';
  }
  return text + "\n" + comparison_table(sets) + "\n" + rates_table(sets);
}

nlohmann::ordered_json to_json(std::span<const ValidationScores> sets) {
  if (sets.size() == 1) return json_of(sets.front());
  nlohmann::ordered_json json;
  for (const ValidationScores& scores : sets) json["sets"].push_back(json_of(scores));
  return json;
}

}  // namespace sdmt::tools
