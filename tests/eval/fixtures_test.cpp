// SPDX-License-Identifier: Apache-2.0
// Every figure that TrackEval gives for the sequences in fixtures/, see fixtures/README.md.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sdmt/eval/prepare.h"
#include "sdmt/eval/scores.h"

namespace sdmt::eval {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const fs::path kFixtures = fs::path(SDMT_TESTS_DIR) / "eval" / "fixtures";
constexpr double kTolerance = 1e-9;

struct Case {
  Benchmark benchmark;
  const char* expected;
};

class TrackEvalFixtures : public testing::TestWithParam<Case> {};

int compare(const Scores& scores, const json& expected, const std::string& name) {
  int compared = 0;
  for (const auto& field : score_fields(scores)) {
    if (!expected.contains(field.name)) continue;
    const auto& want = expected.at(std::string(field.name));
    std::visit(
        [&](const auto value) {
          if constexpr (std::is_integral_v<decltype(value)>) {
            EXPECT_TRUE(want.is_number_integer()) << name << " " << field.name;
            EXPECT_EQ(value, want.get<std::int64_t>()) << name << " " << field.name;
          } else {
            EXPECT_NEAR(value, want.get<double>(), kTolerance) << name << " " << field.name;
          }
        },
        field.value);
    ++compared;
  }
  for (const auto& field : alpha_fields(scores)) {
    const auto& want = expected.at("per_alpha").at(std::string(field.name));
    EXPECT_EQ(want.size(), kNumAlphas);
    std::visit(
        [&](const auto* values) {
          for (std::size_t a = 0; a < kNumAlphas; ++a) {
            EXPECT_NEAR(static_cast<double>((*values)[a]), want.at(a).template get<double>(),
                        kTolerance)
                << name << " " << field.name << " at alpha " << a;
          }
        },
        field.values);
  }
  return compared;
}

TEST_P(TrackEvalFixtures, EveryFieldOfEverySequence) {
  std::ifstream file(kFixtures / "expected" / GetParam().expected);
  const json expected = json::parse(file);
  EXPECT_EQ(expected.at("sequences").size(), 9U);
  std::vector<Scores> all;
  for (const auto& [name, want] : expected.at("sequences").items()) {
    const auto gt = read_sequence_ground_truth(kFixtures / "gt" / name);
    const auto result_file = kFixtures / "results" / (name + ".txt");
    const auto results = mot::read_results(result_file);
    const auto prepared = prepare_sequence(gt, results, result_file.string(), GetParam().benchmark,
                                           Compat::trackeval);
    all.push_back(score_sequence(prepared.similarities, Compat::trackeval));
    // All fields of TrackEval, none of ours left out: per_alpha is one entry more.
    EXPECT_EQ(compare(all.back(), want, name), static_cast<int>(want.size()) - 1);
  }
  const auto& want = expected.at("combined");
  EXPECT_EQ(compare(combine(all, Compat::trackeval), want, "combined"),
            static_cast<int>(want.size()) - 1);
  const auto alphas = hota_alphas();
  for (std::size_t a = 0; a < kNumAlphas; ++a) {
    EXPECT_DOUBLE_EQ(alphas[a], expected.at("alphas").at(a).get<double>());
  }
}

INSTANTIATE_TEST_SUITE_P(All, TrackEvalFixtures,
                         testing::Values(Case{Benchmark::mot15, "MOT15.json"},
                                         Case{Benchmark::mot16, "MOT16.json"},
                                         Case{Benchmark::mot17, "MOT16.json"},
                                         Case{Benchmark::mot20, "MOT20.json"}),
                         [](const testing::TestParamInfo<Case>& each) {
                           return std::string(to_string(each.param.benchmark));
                         });

}  // namespace
}  // namespace sdmt::eval
