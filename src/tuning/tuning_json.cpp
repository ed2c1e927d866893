// SPDX-License-Identifier: Apache-2.0
#include "sdmt/tuning/tuning_json.h"

#include <nlohmann/json.hpp>

#include "sdmt/track/tracker_option_table.h"

namespace sdmt::tuning {

using nlohmann::ordered_json;

namespace {

std::string file_text(const ordered_json& json) {
  return json.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

ordered_json to_json(const ChoiceScores& choice) {
  const auto& [scores, gain] = choice;
  return {{"mota", scores.mean_mota},
          {"idf1", scores.mean_idf1},
          {"pooled_mota", scores.pooled_mota},
          {"pooled_idf1", scores.pooled_idf1},
          {"gain_mota", gain.mota},
          {"gain_mota_error", gain.mota_error},
          {"gain_idf1", gain.idf1},
          {"gain_idf1_error", gain.idf1_error}};
}

ordered_json to_json(const SequenceScores& scores) {
  return {{"mota", scores.mota}, {"idf1", scores.idf1}};
}

ordered_json to_json(const OptionWorth& worth) {
  return {{"option", worth.option},
          {"base", worth.base},
          {"chosen", worth.chosen},
          {"worth_in_sample", worth.in_sample},
          {"worth_held_out", worth.held_out}};
}

ordered_json to_json(const HeldOutSequence& row, const std::vector<OptionWorth>& options) {
  ordered_json values = ordered_json::object();
  for (std::size_t i = 0; i < options.size(); ++i) values[options[i].option] = row.chosen[i];
  return {{"sequence", row.sequence},    {"detections", row.detections},
          {"chosen_without_it", values}, {"held_out", to_json(row.held_out)},
          {"base", to_json(row.base)},   {"bytetrack", to_json(row.bytetrack)}};
}

}  // namespace

std::string tuning_json(const TuningResult& result) {
  ordered_json chosen = ordered_json::object();
  ordered_json options = ordered_json::array();
  for (const OptionWorth& worth : result.options) {
    chosen[worth.option] = worth.chosen;
    options.push_back(to_json(worth));
  }
  ordered_json sequences = ordered_json::array();
  for (const HeldOutSequence& row : result.sequences) {
    sequences.push_back(to_json(row, result.options));
  }
  return file_text({{"sequences", result.sequences.size()},
                    {"settings", result.settings},
                    {"draws", result.draws},
                    {"base", to_json(result.base)},
                    {"in_sample", to_json(result.in_sample)},
                    {"held_out", to_json(result.held_out)},
                    {"bytetrack", to_json(result.bytetrack)},
                    {"chosen", chosen},
                    {"options", options},
                    {"by_sequence", sequences}});
}

std::string preset_json(const track::TrackerOptions& options) {
  ordered_json preset = ordered_json::object();
  for (const auto& option : track::tracker_option_table()) {
    const std::string value = option.get(options);
    if (value == option.get(track::TrackerOptions::tuned())) continue;
    // Numbers and switches are what JSON takes their texts for; words, "-inf" among them, are
    // texts.
    const auto parsed = ordered_json::parse(value, nullptr, false);
    preset[option.name] = parsed.is_discarded() ? ordered_json(value) : parsed;
  }
  return file_text(preset);
}

}  // namespace sdmt::tuning
