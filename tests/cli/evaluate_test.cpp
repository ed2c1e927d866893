// SPDX-License-Identifier: Apache-2.0
// sdmt evaluate from outside: figures, files, and what it says about bad input.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/run_command.h"

namespace sdmt::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const fs::path kFixtures = fs::path(SDMT_TESTS_DIR) / "eval" / "fixtures";

class Evaluate : public testing::Test {
 protected:
  // One person for three frames, found in all of them.
  Evaluate() {
    make_sequence("A", kGt);
    write_file(folder_ / "A.txt", kResults);
  }

  void make_sequence(const std::string& name, const std::string& gt) {
    fs::create_directories(folder_ / ("gt/" + name + "/gt"));
    write_file(folder_ / ("gt/" + name + "/gt/gt.txt"), gt);
    write_file(
        folder_ / ("gt/" + name + "/seqinfo.ini"),
        "[Sequence]\nname=" + name +
            "\nimDir=img1\nframeRate=10\nseqLength=4\nimWidth=640\nimHeight=480\nimExt=.jpg\n");
  }
  CommandResult evaluate(std::vector<std::string> more) {
    std::vector<std::string> words{"evaluate", "--gt", (folder_ / "gt").string(), "--results",
                                   folder_.path().string()};
    words.insert(words.end(), more.begin(), more.end());
    return run_sdmt(words);
  }
  // The message for a result file of this text.
  std::string complaint(const std::string& results, std::vector<std::string> more = {}) {
    write_file(folder_ / "A.txt", results);
    more.insert(more.end(), {"--json", (folder_ / "out.json").string()});
    const auto result = evaluate(more);
    EXPECT_EQ(result.exit_code, 2) << results;
    EXPECT_EQ(result.out, "") << results;
    EXPECT_FALSE(fs::exists(folder_ / "out.json"));
    EXPECT_THAT(result.err, HasSubstr("sdmt evaluate: "));
    return result.err;
  }
  json read_json(const std::string& name) { return json::parse(read_file(folder_ / name)); }

  static constexpr const char* kGt =
      "1,1,100,100,40,80,1,1,1\n2,1,104,100,40,80,1,1,1\n3,1,108,100,40,80,1,1,1\n";
  static constexpr const char* kResults =
      "1,7,100,100,40,80,1,-1,-1,-1\n2,7,104,100,40,80,1,-1,-1,-1\n3,7,108,100,40,80,1,-1,-1,-1\n";
  TemporaryFolder folder_;
};

TEST_F(Evaluate, FixturesGiveTrackEvalsFigures) {
  for (const std::string benchmark : {"MOT15", "MOT16", "MOT17", "MOT20"}) {
    const auto result =
        run_sdmt({"evaluate", "--gt", kFixtures / "gt", "--results", kFixtures / "results",
                  "--benchmark", benchmark, "--json", folder_ / "out.json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto ours = read_json("out.json");
    const auto expected = json::parse(read_file(
        kFixtures / "expected" / ((benchmark == "MOT17" ? "MOT16" : benchmark) + ".json")));
    EXPECT_EQ(ours.at("benchmark"), benchmark);
    EXPECT_EQ(ours.at("compat"), "trackeval");
    EXPECT_EQ(ours.at("sequences").size(), expected.at("sequences").size());
    for (const auto& [name, fields] : expected.at("sequences").items()) {
      for (const auto& [key, value] : fields.items()) {
        if (key == "per_alpha") continue;
        EXPECT_NEAR(ours.at("sequences").at(name).at(key).get<double>(), value.get<double>(), 1e-9)
            << name << " " << key;
      }
    }
    for (const auto& [key, values] : expected.at("combined").at("per_alpha").items()) {
      for (std::size_t a = 0; a < values.size(); ++a) {
        EXPECT_NEAR(ours.at("combined").at("per_alpha").at(key).at(a).get<double>(),
                    values.at(a).get<double>(), 1e-9);
      }
    }
  }
}

TEST_F(Evaluate, PrintsATableAndWritesCsv) {
  const auto result = evaluate({"--csv", (folder_ / "out.csv").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("MOT16, counted as TrackEval"), HasSubstr("COMBINED"),
                                HasSubstr("100.00"), Not(HasSubstr("devkit"))));
  EXPECT_THAT(read_file(folder_ / "out.csv"),
              AllOf(HasSubstr("sequence,MOTA,"), HasSubstr("\nA,1,"), HasSubstr("\nCOMBINED,1,")));
}

TEST_F(Evaluate, BothSwitchCountsAreShownWhenTheyDiffer) {
  // Away in frame 2, back under another id.
  make_sequence("A", "1,1,100,100,40,80,1,1,1\n3,1,108,100,40,80,1,1,1\n");
  write_file(folder_ / "A.txt", "1,7,100,100,40,80,1,-1,-1,-1\n3,8,108,100,40,80,1,-1,-1,-1\n");
  EXPECT_THAT(evaluate({"--json", (folder_ / "out.json").string()}).out, HasSubstr("IDs(devkit)"));
  EXPECT_EQ(read_json("out.json").at("combined").at("IDSW"), 1);
  EXPECT_EQ(read_json("out.json").at("combined").at("IDSW_devkit"), 0);
  const auto devkit = evaluate({"--compat", "devkit", "--json", (folder_ / "out.json").string()});
  EXPECT_THAT(devkit.out, AllOf(HasSubstr("the MATLAB devkit"), HasSubstr("IDs(TrackEval)")));
  EXPECT_EQ(read_json("out.json").at("combined").at("IDSW"), 0);
}

TEST_F(Evaluate, ExplainListsEvents) {
  write_file(folder_ / "A.txt",
             "1,7,100,100,40,80,1,-1,-1,-1\n2,8,104,100,40,80,1,-1,-1,-1\n"
             "2,9,400,100,40,80,1,-1,-1,-1\n");
  const auto result =
      evaluate({"--explain", "--long-miss", "1", "--json", (folder_ / "out.json").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("id switch"), HasSubstr("7 -> 8"),
                                HasSubstr("false track"), HasSubstr("long miss")));
  const auto events = read_json("out.json").at("events").at("A");
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[0].at("event"), "id switch");
  EXPECT_EQ(events[0].at("first_frame"), 2);
  EXPECT_EQ(events[0].at("box"), json({104.0, 100.0, 40.0, 80.0}));
  EXPECT_EQ(events[1].at("result_id"), 9);
  EXPECT_EQ(events[2].at("gt_id"), 1);
}

TEST_F(Evaluate, RenderDrawsTheFramesOfEvents) {
  TemporaryFolder work;
  ASSERT_EQ(run_sdmt({"synth", "scene", "--output", work / "scene", "--frames", "5", "--width",
                      "160", "--height", "120"})
                .exit_code,
            0);
  write_file(work / "nobody.txt", "2,1,5,5,20,40,1,-1,-1,-1\n");
  const std::vector<std::string> words{"evaluate",          "--gt",    work / "scene", "--results",
                                       work / "nobody.txt", "--render"};
  auto without_parent = words;
  without_parent.push_back(work / "no/drawn");
  const auto refused = run_sdmt(without_parent);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_EQ(refused.out, "");
  EXPECT_THAT(refused.err, HasSubstr("no/drawn: the folder cannot be made"));
  auto with_folder = words;
  with_folder.push_back(work / "drawn");
  const auto result = run_sdmt(with_folder);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("1 frames drawn"));
  EXPECT_TRUE(fs::exists(work / "drawn/scene/000002.jpg"));
}

TEST_F(Evaluate, ReportIsOnePageWithoutOtherFiles) {
  ASSERT_EQ(evaluate({"--report", (folder_ / "out.html").string()}).exit_code, 0);
  const auto page = read_file(folder_ / "out.html");
  EXPECT_THAT(page, AllOf(HasSubstr("<svg"), HasSubstr("Tracks over time: A"),
                          Not(HasSubstr("src=\"http")), Not(HasSubstr("<link"))));
  // For dark screens, for those who see no colours, and for small screens.
  EXPECT_THAT(page, AllOf(HasSubstr("prefers-color-scheme: dark"), HasSubstr("stroke-dasharray"),
                          HasSubstr("width=device-width"), Not(HasSubstr("<caption"))));
}

TEST_F(Evaluate, AReportSaysHowItCameAbout) {
  const std::vector<std::string> words{
      "evaluate",        "--gt",     folder_ / "gt",       "--results",
      folder_ / "A.txt", "--report", folder_ / "it's.html"};
  const auto report = [&](const std::string& date) {
    EXPECT_EQ(run_sdmt(words, {{"SOURCE_DATE_EPOCH", date}}).exit_code, 0);
    return read_file(folder_ / "it's.html");
  };
  const auto page = report("86400");
  const std::string version = run_sdmt({"--version"}).out;
  EXPECT_THAT(page, HasSubstr(version.substr(0, version.find(" (")) + ", 1970-01-02 00:00 UTC"));
  EXPECT_THAT(page, HasSubstr("sdmt evaluate --gt " + (folder_ / "gt").string() + " --results "));
  EXPECT_THAT(page, HasSubstr("it&#39;\\&#39;&#39;s.html&#39;"));  // as a shell takes it
  EXPECT_EQ(page, report("86400"));
  EXPECT_NE(page, report("0"));
}

TEST_F(Evaluate, AMissingSequenceIsNamed) {
  make_sequence("B", kGt);
  const auto refused = evaluate({});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("sequence B has no results"), HasSubstr("B.txt"),
                                 HasSubstr("--allow-missing")));
  const auto allowed = evaluate({"--allow-missing", "--json", (folder_ / "out.json").string()});
  EXPECT_EQ(allowed.exit_code, 0) << allowed.err;
  EXPECT_EQ(read_json("out.json").at("sequences").at("B").at("CLR_FN"), 3);
  EXPECT_EQ(read_json("out.json").at("combined").at("MOTA"), 0.5);
  EXPECT_EQ(evaluate({"--sequences", "A"}).exit_code, 0);
  EXPECT_THAT(evaluate({"--sequences", "C"}).err, HasSubstr("sequence C has no ground truth"));
}

TEST_F(Evaluate, BadResultsAreRefusedByName) {
  EXPECT_THAT(complaint("0,7,1,1,4,8,1,-1,-1,-1\n"),
              AllOf(HasSubstr("A.txt:1"), HasSubstr("frame is 0")));
  EXPECT_THAT(complaint("9,7,1,1,4,8,1,-1,-1,-1\n"),
              AllOf(HasSubstr("A.txt: frame 9, id 7"), HasSubstr("4 frames")));
  EXPECT_THAT(complaint("2,7,1,1,4,8,1,-1,-1,-1\n2,7,9,1,4,8,1,-1,-1,-1\n"),
              AllOf(HasSubstr("A.txt: frame 2, id 7"), HasSubstr("more than once")));
  EXPECT_THAT(complaint("1,7,1,1,4,8,1,3,-1,-1\n"), HasSubstr("class is 3"));
  EXPECT_THAT(complaint("1,7,1,1,nan,8,1\n"), HasSubstr("A.txt:1"));
  EXPECT_THAT(complaint("1,7,1,1\n"), HasSubstr("A.txt:1"));
  EXPECT_THAT(complaint("{\"tracks\": []}\n"), HasSubstr("A.txt:1"));
}

TEST_F(Evaluate, TheDevkitPassesOverWhatItNeverSaw) {
  write_file(folder_ / "A.txt",
             std::string("0,7,1,1,4,8,1,-1,-1,-1\n9,7,1,1,4,8,1,5,-1,-1\n") + kResults);
  const auto result = evaluate({"--compat", "devkit", "--json", (folder_ / "out.json").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(read_json("out.json").at("combined").at("MOTA"), 1.0);
}

TEST_F(Evaluate, ConfidenceAndOrderOfRowsDoNotMatter) {
  ASSERT_EQ(evaluate({"--json", (folder_ / "a.json").string()}).exit_code, 0);
  write_file(folder_ / "A.txt",
             "3,7,108,100,40,80,-1,-1,-1,-1\r\n1,7,100,100,40,80,-1,-1,-1,-1\r\n\r\n"
             "2,7,104,100,40,80,-1,-1,-1,-1");
  ASSERT_EQ(evaluate({"--json", (folder_ / "b.json").string()}).exit_code, 0);
  EXPECT_EQ(read_file(folder_ / "a.json"), read_file(folder_ / "b.json"));
}

TEST_F(Evaluate, GroundTruthWithoutClassesIsMot15) {
  make_sequence("A", "1,1,100,100,40,80,1,-1,-1,-1\n");
  write_file(folder_ / "A.txt", "1,7,100,100,40,80,1,-1,-1,-1\n");
  const auto refused = evaluate({});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("gt.txt"), HasSubstr("use MOT15")));
  EXPECT_EQ(evaluate({"--benchmark", "mot15"}).exit_code, 0);
}

TEST_F(Evaluate, BadUsage) {
  EXPECT_EQ(run_sdmt({"evaluate"}).exit_code, 2);
  EXPECT_THAT(evaluate({"--benchmark", "MOT99"}).err, HasSubstr("MOT99"));
  EXPECT_EQ(evaluate({"--compat", "matlab"}).exit_code, 2);
  EXPECT_THAT(evaluate({"--explain", "--long-miss", "0"}).err, HasSubstr("long_miss is 0"));
  const auto nowhere =
      run_sdmt({"evaluate", "--gt", folder_ / "none", "--results", folder_.path()});
  EXPECT_EQ(nowhere.exit_code, 2);
  EXPECT_THAT(nowhere.err, HasSubstr("none"));
  EXPECT_EQ(evaluate({"--json", "/dev/full"}).exit_code, 1);
}

TEST_F(Evaluate, AMillionRows) {
  std::string gt, results;
  for (int frame = 1; frame <= 4; ++frame) {
    for (int id = 1; id <= 50; ++id) {
      gt += std::to_string(frame) + "," + std::to_string(id) + "," + std::to_string(100 * id) +
            ",50,40,80,1,1,1\n";
    }
    for (int id = 1; id <= 250'000; ++id) {
      results += std::to_string(frame) + "," + std::to_string(id) + "," +
                 std::to_string(id % 5000) + "," + std::to_string(id / 5000 * 90) +
                 ",40,80,1,-1,-1,-1\n";
    }
  }
  make_sequence("A", gt);
  write_file(folder_ / "A.txt", results);
  const auto result = evaluate({"--json", (folder_ / "out.json").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(read_json("out.json").at("combined").at("Dets"), 1'000'000);
  EXPECT_EQ(read_json("out.json").at("combined").at("IDs"), 250'000);
}

TEST_F(Evaluate, ASequenceWithoutGroundTruthIsNotLeftOutUnnoticed) {
  make_sequence("B", kGt);
  fs::remove(folder_ / "gt/B/gt/gt.txt");
  const auto result = evaluate({});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("gt/B: has a seqinfo.ini but no ground truth"));
}

TEST_F(Evaluate, OddFolderNamesMakeValidFiles) {
  make_sequence("x,\"y\"\xFF", kGt);
  const auto result =
      run_sdmt({"evaluate", "--gt", folder_ / "gt/x,\"y\"\xFF", "--results", folder_ / "A.txt",
                "--json", folder_ / "out.json", "--csv", folder_ / "out.csv"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(read_json("out.json").at("sequences").contains("x,\"y\"\uFFFD"));
  EXPECT_THAT(read_file(folder_ / "out.csv"), HasSubstr("\n\"x,\"\"y\"\"\xFF\",1,"));
}

TEST_F(Evaluate, AnOutputOntoTheResultsIsRefused) {
  const auto result = run_sdmt({"evaluate", "--gt", folder_ / "gt/A", "--results",
                                folder_ / "A.txt", "--json", folder_ / "A.txt"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(read_file(folder_ / "A.txt"), kResults);
}

}  // namespace
}  // namespace sdmt::tests
