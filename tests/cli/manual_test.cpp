// SPDX-License-Identifier: Apache-2.0
// sdmt manual: what it writes is taken by the programs that read it, and tells every option.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "cli/run_command.h"

namespace sdmt::tests {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

class Manual : public testing::Test {
 protected:
  void SetUp() override {
    const auto result = run_sdmt({"manual", "--output", folder_.path().string()});
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  std::string file(const std::string& name) { return read_file(folder_ / name); }
  // What bash offers for the last of these words.
  std::string offered(const std::vector<std::string>& words) {
    std::string line = "COMP_WORDS=(sdmt";
    for (const auto& word : words) line += " '" + word + "'";
    line += "); COMP_CWORD=" + std::to_string(words.size()) + "; _sdmt; echo \"${COMPREPLY[@]}\"";
    const std::string script = (folder_ / "bash-completion/completions/sdmt").string();
    return run_command({"/bin/bash", "-c", "source '" + script + "'; " + line}).out;
  }

  TemporaryFolder folder_;
};

std::set<std::string> long_options(const std::string& text) {
  static const std::regex kOption("--[a-z][a-z0-9-]+");
  return {std::sregex_token_iterator(text.begin(), text.end(), kOption), {}};
}

TEST_F(Manual, PagesAndCompletionsTellEveryOption) {
  for (const auto& [command, page] :
       {std::pair<std::string, std::string>("track", "sdmt-track"),
        std::pair<std::string, std::string>("synth scene", "sdmt-synth-scene")}) {
    std::vector<std::string> words{"track", "--help"};
    if (command != "track") words = {"synth", "scene", "--help"};
    const auto options = long_options(run_sdmt(words).out);
    EXPECT_GT(options.size(), 5u);
    std::string roff = file("man/man1/" + page + ".1");
    roff = std::regex_replace(roff, std::regex("\\\\-"), "-");
    for (const auto& option : options) {
      EXPECT_THAT(roff, HasSubstr(option)) << command;
      EXPECT_THAT(file("bash-completion/completions/sdmt"), HasSubstr(option)) << command;
      EXPECT_THAT(file("zsh/vendor-completions/_sdmt"), HasSubstr("'*" + option + "['")) << command;
      EXPECT_THAT(file("fish/vendor_completions.d/sdmt.fish"),
                  HasSubstr(" -l " + option.substr(2) + " "))
          << command;
    }
  }
  EXPECT_THAT(file("man/man1/sdmt.1"),
              AllOf(HasSubstr("sdmt track"), HasSubstr("sdmt synth reid")));
}

TEST_F(Manual, BashCompletes) {
  EXPECT_EQ(offered({"tr"}), "train-embedder track\n");
  EXPECT_EQ(offered({"synth", ""}), "scene reid\n");
  EXPECT_EQ(offered({"track", "--outp"}), "--output --output-dir\n");
  EXPECT_EQ(offered({"track", "x.mp4", "--fil"}), "--fill\n");
  EXPECT_EQ(offered({"track", "--fill", ""}), "none merged all\n");
  EXPECT_EQ(offered({"track", "--embed", "n"}), "needed\n");
  EXPECT_EQ(offered({"synth", "scene", "--frame"}), "--frames --frame-rate\n");
  EXPECT_EQ(offered({"track", "--output", "t"}), "\n") << "files are bash's own";
}

TEST_F(Manual, ShellsAndManTakeThem) {
  const auto check = [&](const std::vector<std::string>& words) {
    if (run_command({"/usr/bin/test", "-x", words[0]}).exit_code != 0) return;
    const auto result = run_command(words);
    EXPECT_EQ(result.exit_code, 0) << words[0] << ": " << result.err;
    EXPECT_EQ(result.err, "") << words[0];
  };
  check({"/bin/bash", "-n", folder_ / "bash-completion/completions/sdmt"});
  check({"/usr/bin/zsh", "-n", folder_ / "zsh/vendor-completions/_sdmt"});
  check({"/usr/bin/fish", "--no-execute", folder_ / "fish/vendor_completions.d/sdmt.fish"});
  check({"/usr/bin/groff", "-man", "-Tutf8", "-ww", "-z", folder_ / "man/man1/sdmt-track.1"});
}

}  // namespace
}  // namespace sdmt::tests
