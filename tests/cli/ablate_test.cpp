// SPDX-License-Identifier: Apache-2.0
// sdmt ablate from outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <ostream>

#include "cli/run_command.h"

namespace sdmt::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

json row(const json& run, const std::string& variant) {
  for (const auto& each : run.at("rows")) {
    if (each.at("variant") == variant) return each;
  }
  return nullptr;
}

struct Published {
  const char* sequence;
  const char* variant;
  int fp, fn, ids;
  double mota;  // per cent, one decimal
};

// Names the test.
std::ostream& operator<<(std::ostream& out, const Published& published) {
  return out << published.sequence << " " << published.variant;
}

class Baselines : public testing::TestWithParam<Published> {};

// SORT's published implementation on its own detections, and the paper's rules by motion alone as
// an independent implementation in Python scored them.
TEST_P(Baselines, OnTud) {
  const auto folder = fs::path(SDMT_DATA_DIR) / "mot15" / GetParam().sequence;
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
  TemporaryFolder work;
  const auto result = run_sdmt({"ablate", "--sequences", folder, "--detections", "det-frcnn.txt",
                                "--json", work / "out.json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto found = row(json::parse(read_file(work / "out.json")), GetParam().variant);
  EXPECT_EQ(found.at("fp"), GetParam().fp);
  EXPECT_EQ(found.at("fn"), GetParam().fn);
  EXPECT_EQ(found.at("ids"), GetParam().ids);
  EXPECT_DOUBLE_EQ(std::round(found.at("mota").get<double>() * 1000) / 10, GetParam().mota);
}

INSTANTIATE_TEST_SUITE_P(All, Baselines,
                         testing::Values(Published{"TUD-Campus", "SORT", 15, 113, 6, 62.7},
                                         Published{"TUD-Stadtmitte", "SORT", 22, 295, 10, 71.7}));

class Ablate : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(run_sdmt({"synth", "scene", "--output", folder_ / "scene", "--frames", "10",
                        "--width", "320", "--height", "240"})
                  .exit_code,
              0);
  }
  CommandResult ablate(std::vector<std::string> more) {
    std::vector<std::string> words{"ablate", "--sequences", folder_ / "scene"};
    words.insert(words.end(), more.begin(), more.end());
    return run_sdmt(words);
  }
  // Rows without their speeds, which no two runs share.
  json rows(const std::string& name) {
    auto run = json::parse(read_file(folder_ / name));
    for (auto& each : run.at("rows")) each.erase("fps");
    return run.at("rows");
  }
  TemporaryFolder folder_;
};

TEST_F(Ablate, AllRowsWithFramesAndTheSameOnesAgain) {
  ASSERT_EQ(
      run_sdmt({"init-model", "--seed", "1", "--output", folder_ / "m.safetensors"}).exit_code, 0);
  const std::string model = folder_ / "m.safetensors";
  const auto first = ablate({"--model", model, "--json", folder_ / "a.json", "--report",
                             folder_ / "a.html", "--threads", "1"});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const auto second = ablate({"--model", model, "--json", folder_ / "b.json", "--threads", "2"});
  ASSERT_EQ(second.exit_code, 0) << second.err;
  const auto found = rows("a.json");
  EXPECT_EQ(found, rows("b.json"));
  EXPECT_EQ(found.size(), 13U);
  for (const auto& each : found) {
    EXPECT_TRUE(each.contains("mota")) << each.dump();
    EXPECT_TRUE(each.at("sequences").contains("scene"));
  }
  EXPECT_EQ(found.at(0).at("paper").at("fp"), 6014);
  EXPECT_THAT(first.out, AllOf(HasSubstr("with boosting"), HasSubstr("65863"), HasSubstr("SORT")));
  EXPECT_THAT(read_file(folder_ / "a.html"),
              AllOf(HasSubstr("<svg"), HasSubstr("Tracks over time")));
}

TEST_F(Ablate, RowsThatNeedFramesSaySo) {
  fs::remove_all(folder_ / "scene/img1");
  const auto result = ablate({"--json", (folder_ / "out.json").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto run = json::parse(read_file(folder_ / "out.json"));
  EXPECT_THAT(row(run, "lambda=1").at("skipped").get<std::string>(), HasSubstr("needs frames"));
  EXPECT_FALSE(row(run, "lambda=1").contains("mota"));
  for (const std::string name : {"without appearance", "SORT", "tuned, no appearance"}) {
    EXPECT_TRUE(row(run, name).contains("mota")) << name;
  }
}

TEST_F(Ablate, OnlyTheVariantsAskedForAndNoNetworkForThem) {
  const auto result = ablate({"--variants", "tuned, no appearance", "SORT", "--model",
                              "no.safetensors", "--json", folder_ / "out.json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::vector<std::string> names;
  for (const auto& each : rows("out.json")) names.push_back(each.at("variant"));
  EXPECT_THAT(names, testing::ElementsAre("SORT", "tuned, no appearance"));
  const auto unknown = ablate({"--variants", "tuned", "lambda=2"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, AllOf(HasSubstr("'lambda=2'"), HasSubstr("'lambda=0.5'")));
}

TEST_F(Ablate, WholePeopleAreOursAndThoseOfThePeerThatIsTreatedAlike) {
  // Somebody walks out of a picture of 640 pixels, and is annotated as whole.
  std::string truth, boxes;
  for (int frame = 1; frame <= 60; ++frame) {
    const int left = 500 + 2 * frame, width = std::min(40, 641 - left);
    const std::string number = std::to_string(frame) + ",", place = std::to_string(left) + ",100,";
    truth += number + "1," + place + "40,90,1,1,1\n";
    boxes += number + "-1," + place + std::to_string(width) + ",90,0.9\n";
  }
  std::filesystem::create_directories(folder_ / "edge/det");
  std::filesystem::create_directories(folder_ / "edge/gt");
  write_file(folder_ / "edge/seqinfo.ini",
             "[Sequence]\nname=edge\nframeRate=25\nseqLength=60\nimWidth=640\nimHeight=480\n");
  write_file(folder_ / "edge/gt/gt.txt", truth);
  write_file(folder_ / "edge/det/det.txt", boxes);
  std::vector<std::string> words{"ablate",
                                 "--sequences",
                                 folder_ / "edge",
                                 "--variants",
                                 "SORT",
                                 "ByteTrack",
                                 "ByteTrack, smoothed and filled",
                                 "tuned, no appearance",
                                 "online, no appearance",
                                 "--json"};
  words.push_back(folder_ / "off.json");
  ASSERT_EQ(run_sdmt(words).exit_code, 0);
  words.back() = folder_ / "on.json";
  words.emplace_back("--amodal");
  ASSERT_EQ(run_sdmt(words).exit_code, 0);
  const auto off = rows("off.json"), on = rows("on.json");
  ASSERT_EQ(on.size(), 5U);
  for (std::size_t i = 0; i < on.size(); ++i) {
    const std::string name = on[i].at("variant");
    const double gain = on[i].at("hota").get<double>() - off[i].at("hota").get<double>();
    if (name == "SORT" || name == "ByteTrack") {
      EXPECT_EQ(gain, 0) << name;
    } else {
      EXPECT_GT(gain, 0.05) << name;
    }
  }
}

TEST_F(Ablate, BadUsage) {
  EXPECT_EQ(run_sdmt({"ablate"}).exit_code, 2);
  const auto no_file = ablate({"--detections", "none.txt"});
  EXPECT_EQ(no_file.exit_code, 2);
  EXPECT_THAT(no_file.err, HasSubstr("none.txt"));
  EXPECT_THAT(ablate({"--calibration", "x"}).err, HasSubstr("x"));
  EXPECT_THAT(ablate({"--model", "no.safetensors"}).err, HasSubstr("no.safetensors"));
  EXPECT_THAT(ablate({"--sequences", folder_ / "scene"}).err, HasSubstr("given twice"));
}

TEST_F(Ablate, AnOutputThatCannotBeWrittenIsNoticedBeforeTheWork) {
  for (const std::string option : {"--json", "--report"}) {
    const auto result = ablate({option, folder_ / "no/file"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, HasSubstr("no/file"));
    EXPECT_THAT(result.err, Not(HasSubstr("frames/s")));
  }
}

}  // namespace
}  // namespace sdmt::tests
