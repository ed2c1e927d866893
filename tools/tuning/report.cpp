// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "cli/text_table.h"
#include "sdmt/track/tracker_option_table.h"
#include "tuning/tuning.h"

namespace sdmt::tools {

using nlohmann::ordered_json;

namespace {

std::vector<int> everywhere(const eval::RunGrid& grid, int setting) {
  return std::vector<int>(grid.sequences(), setting);
}

// All settings, or those that leave option `fixed` at the base's value.
std::vector<int> settings_with(const TuningPlan& plan, int fixed) {
  std::vector<int> settings;
  for (int i = 0; i < static_cast<int>(plan.settings.size()); ++i) {
    if (fixed < 0 || plan.settings[i].values[fixed] == plan.settings.front().values[fixed]) {
      settings.push_back(i);
    }
  }
  return settings;
}

ordered_json scores_json(const eval::RunGrid& grid, const std::vector<int>& settings) {
  const auto scores = eval::grid_scores(grid, settings);
  const auto gain = eval::paired_gain(grid, settings, everywhere(grid, 0));
  return {{"mota", scores.mean_mota},
          {"idf1", scores.mean_idf1},
          {"pooled_mota", scores.pooled_mota},
          {"pooled_idf1", scores.pooled_idf1},
          {"gain_mota", gain.mota},
          {"gain_mota_error", gain.mota_error},
          {"gain_idf1", gain.idf1},
          {"gain_idf1_error", gain.idf1_error}};
}

ordered_json values_json(const TuningPlan& plan, int setting) {
  ordered_json values = ordered_json::object();
  for (std::size_t i = 0; i < plan.tuned.size(); ++i) {
    values[plan.tuned[i].name] = plan.settings[setting].values[i];
  }
  return values;
}

ordered_json sequence_json(const TuningPlan& plan, const eval::RunGrid& grid, int sequence,
                           int held_out) {
  const auto scores = [&](int setting) {
    double mota = 0, idf1 = 0;
    for (int draw = 0; draw < grid.draws(); ++draw) {
      mota += grid.at(setting, sequence, draw).mota() / grid.draws();
      idf1 += grid.at(setting, sequence, draw).idf1() / grid.draws();
    }
    return ordered_json{{"mota", mota}, {"idf1", idf1}};
  };
  return {{"sequence", grid.place(sequence)},
          {"detections", plan.sequences[sequence].detector},
          {"chosen_without_it", values_json(plan, held_out)},
          {"held_out", scores(held_out)},
          {"base", scores(0)},
          {"bytetrack", scores(grid.settings() - 1)}};
}

std::string percent(const ordered_json& fraction) {
  return fmt::format("{:.1f}", 100 * fraction.get<double>());
}

std::string signed_percent(const ordered_json& fraction) {
  return fmt::format("{:+.1f}", 100 * fraction.get<double>());
}

std::string gain_text(const ordered_json& scores, const std::string& score) {
  return fmt::format("{} ({:.1f})", signed_percent(scores.at("gain_" + score)),
                     100 * scores.at("gain_" + score + "_error").get<double>());
}

std::string values_text(const ordered_json& values) {
  std::string text;
  for (const auto& [name, value] : values.items()) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, value.get<std::string>());
  }
  return text;
}

}  // namespace

ordered_json tuning_json(const TuningPlan& plan, const eval::RunGrid& grid) {
  const auto all = settings_with(plan, -1);
  const int best = eval::best_setting(grid, all, "");
  const auto held_out = eval::held_out_settings(grid, all);
  ordered_json json{{"sequences", grid.sequences()},
                    {"settings", plan.settings.size()},
                    {"draws", grid.draws()},
                    {"base", scores_json(grid, everywhere(grid, 0))},
                    {"in_sample", scores_json(grid, everywhere(grid, best))},
                    {"held_out", scores_json(grid, held_out)},
                    {"bytetrack", scores_json(grid, everywhere(grid, grid.settings() - 1))},
                    {"chosen", values_json(plan, best)}};
  const double in_sample = eval::grid_scores(grid, everywhere(grid, best)).objective();
  const double outside = eval::grid_scores(grid, held_out).objective();
  for (std::size_t i = 0; i < plan.tuned.size(); ++i) {
    const auto without = settings_with(plan, static_cast<int>(i));
    const int second = eval::best_setting(grid, without, "");
    const auto left = eval::held_out_settings(grid, without);
    json["options"].push_back(
        {{"option", plan.tuned[i].name},
         {"base", plan.settings.front().values[i]},
         {"chosen", plan.settings[best].values[i]},
         {"worth_in_sample",
          in_sample - eval::grid_scores(grid, everywhere(grid, second)).objective()},
         {"worth_held_out", outside - eval::grid_scores(grid, left).objective()}});
  }
  for (int i = 0; i < grid.sequences(); ++i) {
    json["by_sequence"].push_back(sequence_json(plan, grid, i, held_out[i]));
  }
  return json;
}

std::string tuning_text(const ordered_json& found) {
  TextTable scores(
      {"options", "MOTA", "IDF1", "all boxes: MOTA", "IDF1", "over base: MOTA", "IDF1"});
  const auto row = [&](const char* name, const char* key) {
    const auto& each = found.at(key);
    scores.add_row({name, percent(each.at("mota")), percent(each.at("idf1")),
                    percent(each.at("pooled_mota")), percent(each.at("pooled_idf1")),
                    gain_text(each, "mota"), gain_text(each, "idf1")});
  };
  row("base", "base");
  row("chosen on all (in sample)", "in_sample");
  row("chosen without the sequence (held out)", "held_out");
  row("ByteTrack, smoothed and filled as base", "bytetrack");

  TextTable options({"option", "base", "chosen", "worth in sample", "held out"});
  for (const auto& each : found.at("options")) {
    options.add_row({each.at("option"), each.at("base"), each.at("chosen"),
                     signed_percent(each.at("worth_in_sample")),
                     signed_percent(each.at("worth_held_out"))});
  }

  TextTable sequences(
      {"sequence", "detections", "held out", "base", "ByteTrack", "chosen without it"}, {1, 5});
  for (const auto& each : found.at("by_sequence")) {
    const auto pair = [&](const char* key) {
      return percent(each.at(key).at("mota")) + " / " + percent(each.at(key).at("idf1"));
    };
    sequences.add_row({each.at("sequence"), each.at("detections"), pair("held_out"), pair("base"),
                       pair("bytetrack"), values_text(each.at("chosen_without_it"))});
  }
  return scores.str() +
         "means over sequences and draws; in brackets the standard error over sequences\n\n" +
         options.str() + "in points of MOTA + IDF1\n\n" + sequences.str() + "MOTA / IDF1\n";
}

ordered_json tuned_preset(const TuningPlan& plan, const eval::RunGrid& grid) {
  const int best = eval::best_setting(grid, settings_with(plan, -1), "");
  const track::TrackerOptions& chosen = plan.settings[best].options;
  ordered_json preset = ordered_json::object();
  for (const auto& option : track::tracker_option_table()) {
    const std::string value = option.get(chosen);
    if (value == option.get(track::TrackerOptions::tuned())) continue;
    // Numbers and switches are what JSON takes their texts for; words, "-inf" among them, are texts.
    const auto parsed = ordered_json::parse(value, nullptr, false);
    preset[option.name] = parsed.is_discarded() ? ordered_json(value) : parsed;
  }
  return preset;
}

}  // namespace sdmt::tools
