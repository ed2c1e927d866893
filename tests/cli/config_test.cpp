// SPDX-License-Identifier: Apache-2.0
// --config, seen from outside: sdmt synth scene tells what it was given in seqinfo.ini.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/run_command.h"

namespace sdmt::tests {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class Config : public testing::Test {
 protected:
  CommandResult make_scene(std::vector<std::string> more) {
    std::vector<std::string> words{"synth",    "scene", "--output", (folder_ / "scene").string(),
                                   "--height", "120",   "--width",  "160"};
    words.insert(words.end(), more.begin(), more.end());
    return run_sdmt(words);
  }
  std::string config(const std::string& name, const std::string& text) {
    write_file(folder_ / name, text);
    return folder_ / name;
  }
  std::string info() { return read_file(folder_ / "scene/seqinfo.ini"); }

  TemporaryFolder folder_;
};

TEST_F(Config, OptionsComeFromTheFile) {
  const auto result =
      make_scene({"--config", config("a.json", R"({"frames": 3, "frame-rate": 12.5})")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(info(), AllOf(HasSubstr("seqLength=3\n"), HasSubstr("frameRate=12.5\n")));
}

TEST_F(Config, TheCommandLineWinsAndALaterFileWins) {
  const auto a = config("a.json", R"({"frames": 3, "walkers": 4, "frame-rate": 5})");
  const auto b = config("b.json", R"({"frames": 4, "frame-rate": 6})");
  const auto result = make_scene({"--config", a, "--config=" + b, "--frames", "2"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(info(), AllOf(HasSubstr("seqLength=2\n"), HasSubstr("frameRate=6\n")));
  EXPECT_THAT(result.out, HasSubstr("4 walkers"));
}

TEST_F(Config, ATypedOptionWinsOverTheFilesThatItExcludes) {
  const auto file = config("a.json", R"({"architecture": "lite"})");
  const std::string missing = folder_ / "missing.safetensors";
  const auto result = run_sdmt({"bench", "--config", file, "--model", missing});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.err, AllOf(HasSubstr(missing), testing::Not(HasSubstr("excludes"))));
  EXPECT_THAT(run_sdmt({"bench", "--architecture", "lite", "--model", missing}).err,
              HasSubstr("excludes"));
}

TEST_F(Config, AnUnknownKeyIsAnErrorNamingFileAndKey) {
  const auto result = make_scene({"--config", config("a.json", R"({"frame": 3})")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, AllOf(HasSubstr("sdmt synth scene: "), HasSubstr("a.json"),
                                HasSubstr("\"frame\""), HasSubstr("no such option")));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "scene"));
}

TEST_F(Config, AWrongTypeIsAnErrorNamingFileAndKey) {
  for (const std::string value : {R"("three")", "2.5", "true", "[1, 2]", "null", "{}"}) {
    const auto result = make_scene({"--config", config("a.json", "{\"frames\": " + value + "}")});
    EXPECT_EQ(result.exit_code, 2) << value;
    EXPECT_THAT(result.err, AllOf(HasSubstr("a.json"), HasSubstr("frames"), HasSubstr("expected")))
        << value;
  }
}

TEST_F(Config, AValueThatTheCommandRefusesIsTracedToItsFile) {
  const auto result = make_scene({"--config", config("a.json", R"({"threads": 0})")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, AllOf(HasSubstr("--threads"), HasSubstr("a.json")));
}

TEST_F(Config, NoJsonNoObjectNoFile) {
  auto result = make_scene({"--config", config("a.json", "{\"frames\": 3")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, AllOf(HasSubstr("a.json"), HasSubstr("not valid JSON")));
  result = make_scene({"--config", config("a.json", "[1]")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, AllOf(HasSubstr("a.json"), HasSubstr("object")));
  result = make_scene({"--config", (folder_ / "none.json").string()});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("none.json"));
}

TEST_F(Config, KeysThatComeTwiceAndDeepNestingAreRefused) {
  auto result = make_scene({"--config", config("a.json", R"({"frames": 3, "frames": 4})")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("a.json: has key frames twice"));
  const std::string open(60'000, '['), close(60'000, ']');
  result = make_scene({"--config", config("a.json", R"({"frames": )" + open + close + "}")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("a.json: is nested more than 16 levels deep"));
}

TEST_F(Config, AShippedFileIsFoundByItsName) {
  std::filesystem::create_directories(folder_ / "share/configs");
  config("share/configs/short.json", R"({"frames": 1})");
  const auto share = std::map<std::string, std::string>{{"SDMT_SHARE_DIR", folder_ / "share"}};
  const auto result = run_sdmt({"synth", "scene", "--output", folder_ / "scene", "--width", "160",
                                "--height", "120", "--config", "short"},
                               share);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(info(), HasSubstr("seqLength=1\n"));
}

TEST(CommandLine, HelpAndVersionSucceed) {
  EXPECT_EQ(run_sdmt({"--help"}).exit_code, 0);
  EXPECT_THAT(run_sdmt({"--version"}).out, HasSubstr("sdmt "));
  const auto help = run_sdmt({"synth", "scene", "--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, AllOf(HasSubstr("--config"), HasSubstr("--threads")));
}

TEST(CommandLine, BadUsageExitsWith2AndOneLine) {
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
           {}, {"frobnicate"}, {"synth"}, {"synth", "scene"}, {"synth", "scene", "--frobnicate"}}) {
    const auto result = run_sdmt(words);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_TRUE(result.err.starts_with("sdmt")) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  EXPECT_THAT(run_sdmt({"frobnicate"}).err, HasSubstr("frobnicate"));
}

}  // namespace
}  // namespace sdmt::tests
