// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/held_out.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "sdmt/nn/random.h"

namespace sdmt::eval {
namespace {

using ::testing::ElementsAre;

RunGrid random_grid(std::vector<std::string> places, int settings, int draws, std::uint64_t seed) {
  nn::Random random(seed);
  RunGrid grid(std::move(places), settings, draws);
  const auto number = [&](int below) { return static_cast<std::int64_t>(random.below(below)); };
  for (int setting = 0; setting < settings; ++setting) {
    for (int i = 0; i < grid.sequences(); ++i) {
      for (int draw = 0; draw < draws; ++draw) {
        grid.at(setting, i, draw) = {100 + number(50), number(30), number(40), number(9),
                                     80 + number(60),  number(50), number(50)};
      }
    }
  }
  return grid;
}

std::vector<int> all_of(const RunGrid& grid) {
  std::vector<int> settings(grid.settings());
  std::iota(settings.begin(), settings.end(), 0);
  return settings;
}

double ratio(std::int64_t part, std::int64_t whole) {
  return static_cast<double>(part) / static_cast<double>(whole);
}

// By the definition, in another order: for each sequence and setting, the scores of all sequences
// of other places are listed and added up.
std::vector<int> brute_force(const RunGrid& grid) {
  std::vector<int> chosen;
  for (int out = 0; out < grid.sequences(); ++out) {
    std::vector<double> sums;
    for (int setting = 0; setting < grid.settings(); ++setting) {
      std::vector<double> scores;
      for (int draw = 0; draw < grid.draws(); ++draw) {
        for (int i = 0; i < grid.sequences(); ++i) {
          if (grid.place(i) == grid.place(out)) continue;
          const RunCounts& c = grid.at(setting, i, draw);
          scores.push_back(1 - ratio(c.fp + c.fn + c.idsw, c.tp + c.fn));
          const double precision = ratio(c.idtp, c.idtp + c.idfp);
          const double recall = ratio(c.idtp, c.idtp + c.idfn);
          scores.push_back(2 * precision * recall / (precision + recall));
        }
      }
      sums.push_back(std::accumulate(scores.begin(), scores.end(), 0.0));
    }
    chosen.push_back(static_cast<int>(std::max_element(sums.begin(), sums.end()) - sums.begin()));
  }
  return chosen;
}

TEST(HeldOut, ChoosesByTheOtherPlacesAlone) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const RunGrid grid = random_grid({"a", "b", "a", "c", "d"}, 12, 3, seed);
    EXPECT_EQ(held_out_settings(grid, all_of(grid)), brute_force(grid)) << seed;
  }
}

TEST(HeldOut, TheSequenceLeftOutHasNoSay) {
  RunGrid grid = random_grid({"a", "b", "c"}, 8, 2, 1);
  const int before = held_out_settings(grid, all_of(grid))[1];
  for (int setting = 0; setting < 8; ++setting) grid.at(setting, 1, 0) = {1, 1000, 1, 1, 1, 1, 1};
  grid.at((before + 1) % 8, 1, 0) = {1000, 0, 0, 0, 1000, 0, 0};
  EXPECT_EQ(held_out_settings(grid, all_of(grid))[1], before);
}

TEST(HeldOut, OnlyAllowedSettingsAreChosenAndTheFirstOfEquals) {
  const RunGrid grid = random_grid({"a", "b", "c"}, 8, 2, 4);
  const std::vector<int> allowed{5, 2};
  for (const int setting : held_out_settings(grid, allowed))
    EXPECT_TRUE(setting == 5 || setting == 2);
  RunGrid equal({"a", "b"}, 3, 1);
  EXPECT_THAT(held_out_settings(equal, std::vector<int>{2, 0, 1}), ElementsAre(2, 2));
}

TEST(HeldOut, ScoresPoolBoxesAndAverageSequences) {
  RunGrid grid({"a", "b"}, 1, 1);
  grid.at(0, 0, 0) = {90, 0, 10, 0, 50, 0, 50};     // MOTA 0.9, IDF1 2/3
  grid.at(0, 1, 0) = {150, 30, 150, 0, 150, 0, 0};  // MOTA 0.4, IDF1 1
  const std::vector<int> one{0, 0};
  const GridScores scores = grid_scores(grid, one);
  EXPECT_DOUBLE_EQ(scores.pooled_mota, 210.0 / 400);
  EXPECT_DOUBLE_EQ(scores.pooled_idf1, 400.0 / 450);
  EXPECT_DOUBLE_EQ(scores.mean_mota, 0.65);
  EXPECT_DOUBLE_EQ(scores.mean_idf1, (2.0 / 3 + 1) / 2);
}

TEST(HeldOut, GainsComeWithTheErrorOfTheirMean) {
  RunGrid grid({"a", "b"}, 2, 1);
  for (int i = 0; i < 2; ++i) grid.at(0, i, 0) = {50, 0, 50, 0, 50, 0, 50};
  grid.at(1, 0, 0) = {60, 0, 40, 0, 50, 0, 50};
  grid.at(1, 1, 0) = {80, 0, 20, 0, 50, 0, 50};
  const PairedGain gain = paired_gain(grid, std::vector<int>{1, 1}, std::vector<int>{0, 0});
  EXPECT_DOUBLE_EQ(gain.mota, 0.2);  // of 0.1 and 0.3
  EXPECT_NEAR(gain.mota_error, std::sqrt(0.02) / std::sqrt(2.0), 1e-12);
  EXPECT_DOUBLE_EQ(gain.idf1, 0);
}

TEST(HeldOut, OnePlaceIsTooFew) {
  EXPECT_THROW(RunGrid({"a", "a"}, 2, 1), std::invalid_argument);
  EXPECT_THROW(RunGrid({"a", "b"}, 0, 1), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::eval
