// SPDX-License-Identifier: Apache-2.0
#include "sdmt/tuning/tuning_result.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "sdmt/nn/random.h"
#include "sdmt/track/tracker_option_table.h"
#include "sdmt/tuning/tuning_json.h"

namespace sdmt::tuning {
namespace {

using nlohmann::json;
using testing::ElementsAre;

// Three sequences of one frame; two options with two values each.
TuningPlan made_plan() {
  TuningPlan plan;
  plan.tuned = {"min-length", "report"};
  plan.draws = 2;
  for (const char* name : {"a", "b", "c"}) {
    TuningSequence input;
    input.gt.name = name;
    input.detector = "det.txt";
    plan.sequences.push_back(input);
  }
  for (const auto& [length, report] : {std::pair("6", "smoothed"), std::pair("2", "smoothed"),
                                       std::pair("6", "filtered"), std::pair("2", "filtered")}) {
    TuningSetting setting{{}, {length, report}};
    setting.options.confidence.min_length = std::stoi(length);
    if (std::string(report) == "filtered") {
      setting.options.output.report = track::ReportBox::filtered;
    }
    plan.settings.push_back(setting);
  }
  return plan;
}

eval::RunGrid made_grid(const TuningPlan& plan, std::uint64_t seed) {
  nn::Random random(seed);
  eval::RunGrid grid({"a", "b", "c"}, static_cast<int>(plan.settings.size()) + 1, plan.draws);
  const auto number = [&] { return static_cast<std::int64_t>(random.below(100)); };
  for (int setting = 0; setting < grid.settings(); ++setting) {
    for (int i = 0; i < 3; ++i) {
      for (int draw = 0; draw < grid.draws(); ++draw) {
        grid.at(setting, i, draw) = {100 + number(), number(), 10 + number(), number() / 10,
                                     90 + number(),  number(), 10 + number()};
      }
    }
  }
  return grid;
}

// MOTA + IDF1 on a sequence, by their definitions.
double sum(const eval::RunGrid& grid, int setting, int sequence) {
  double scores = 0;
  for (int draw = 0; draw < grid.draws(); ++draw) {
    const auto& run = grid.at(setting, sequence, draw);
    const auto people = static_cast<double>(run.tp + run.fn);
    scores += 1 - static_cast<double>(run.fn + run.fp + run.idsw) / people;
    scores +=
        2 * static_cast<double>(run.idtp) / static_cast<double>(2 * run.idtp + run.idfp + run.idfn);
  }
  return scores / grid.draws();
}

// The best of `allowed` on all sequences but one, -1: on all.
int best_without(const eval::RunGrid& grid, const std::vector<int>& allowed, int left_out) {
  return *std::max_element(allowed.begin(), allowed.end(), [&](int a, int b) {
    double of_a = 0, of_b = 0;
    for (int i = 0; i < 3; ++i) {
      if (i != left_out) of_a += sum(grid, a, i), of_b += sum(grid, b, i);
    }
    return of_a < of_b;
  });
}

double in_sample(const eval::RunGrid& grid, const std::vector<int>& allowed) {
  const int best = best_without(grid, allowed, -1);
  return (sum(grid, best, 0) + sum(grid, best, 1) + sum(grid, best, 2)) / 3;
}

double held_out(const eval::RunGrid& grid, const std::vector<int>& allowed) {
  double all = 0;
  for (int i = 0; i < 3; ++i) all += sum(grid, best_without(grid, allowed, i), i);
  return all / 3;
}

TEST(TuningResult, AgreesWithTryingEverything) {
  const TuningPlan plan = made_plan();
  const std::vector<int> all{0, 1, 2, 3}, length_fixed{0, 2}, report_fixed{0, 1};
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const eval::RunGrid grid = made_grid(plan, seed);
    const TuningResult result = tuning_result(plan, grid);
    const int best = best_without(grid, all, -1);
    EXPECT_EQ(result.settings, 4);
    EXPECT_EQ(result.chosen.confidence.min_length,
              plan.settings[best].options.confidence.min_length);
    EXPECT_NEAR(result.in_sample.scores.objective(), in_sample(grid, all), 1e-12);
    EXPECT_NEAR(result.held_out.scores.objective(), held_out(grid, all), 1e-12);
    EXPECT_EQ(result.base.gain.mota, 0);
    ASSERT_EQ(result.options.size(), 2U);
    EXPECT_EQ(result.options[0].option, "min-length");
    EXPECT_EQ(result.options[1].base, "smoothed");
    EXPECT_EQ(result.options[1].chosen, plan.settings[best].values[1]);
    for (const auto& [option, fixed] : {std::pair(0, length_fixed), std::pair(1, report_fixed)}) {
      EXPECT_NEAR(result.options[option].in_sample, in_sample(grid, all) - in_sample(grid, fixed),
                  1e-12);
      EXPECT_NEAR(result.options[option].held_out, held_out(grid, all) - held_out(grid, fixed),
                  1e-12);
    }
    for (int i = 0; i < 3; ++i) {
      const HeldOutSequence& row = result.sequences[i];
      const int without = best_without(grid, all, i);
      EXPECT_EQ(row.chosen, plan.settings[without].values);
      EXPECT_NEAR(row.held_out.mota + row.held_out.idf1, sum(grid, without, i), 1e-12);
      EXPECT_NEAR(row.base.mota + row.base.idf1, sum(grid, 0, i), 1e-12);
      EXPECT_NEAR(row.bytetrack.mota + row.bytetrack.idf1, sum(grid, 4, i), 1e-12);
    }
  }
}

TEST(TuningJson, HoldsTheResult) {
  const TuningPlan plan = made_plan();
  const TuningResult result = tuning_result(plan, made_grid(plan, 7));
  const json found = json::parse(tuning_json(result));
  EXPECT_EQ(found.at("sequences"), 3);
  EXPECT_EQ(found.at("settings"), 4);
  EXPECT_EQ(found.at("draws"), 2);
  EXPECT_EQ(found.at("held_out").at("mota"), result.held_out.scores.mean_mota);
  EXPECT_EQ(found.at("bytetrack").at("gain_idf1_error"), result.bytetrack.gain.idf1_error);
  EXPECT_EQ(found.at("chosen").at("report"), result.options[1].chosen);
  EXPECT_EQ(found.at("options")[0].at("worth_held_out"), result.options[0].held_out);
  const json& row = found.at("by_sequence")[2];
  EXPECT_EQ(row.at("sequence"), "c");
  EXPECT_EQ(row.at("detections"), "det.txt");
  EXPECT_EQ(row.at("chosen_without_it").at("min-length"), result.sequences[2].chosen[0]);
  EXPECT_EQ(row.at("bytetrack").at("idf1"), result.sequences[2].bytetrack.idf1);
}

TEST(TuningJson, APresetHoldsWhatDiffers) {
  EXPECT_EQ(preset_json({}), "{}\n");
  track::TrackerOptions options;
  options.confidence.min_length = 3;
  options.association.enabled = false;
  options.input.min_confidence = 0.25;
  options.input.calibration = {0.5, 2};
  const json preset = json::parse(preset_json(options));
  EXPECT_EQ(preset.size(), 4U);
  EXPECT_EQ(preset.at("min-length").dump(), "3");
  EXPECT_EQ(preset.at("association"), false);
  EXPECT_EQ(preset.at("min-confidence"), 0.25);
  EXPECT_EQ(preset.at("calibration"), "0.5,2");
  EXPECT_EQ(json::parse(preset_json(track::TrackerOptions::paper())).at("strong-confidence"),
            "-inf");
}

}  // namespace
}  // namespace sdmt::tuning
