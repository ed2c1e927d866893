// SPDX-License-Identifier: Apache-2.0
// The codecs of images and videos bring some 230 libraries, which are loaded when they are needed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>

#include "cli/run_command.h"
#include "reid/formula_network.h"

namespace sdmt::tests {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

TEST(Codecs, AreNotWhatTheBinaryStartsWith) {
  if (kSanitized) GTEST_SKIP() << "checks of types need the libraries from the start";
  const auto libraries = run_sdmt({}, {{"LD_TRACE_LOADED_OBJECTS", "1"}});
  EXPECT_THAT(libraries.out, AllOf(HasSubstr("libopencv_core"), Not(HasSubstr("imgcodecs")),
                                   Not(HasSubstr("videoio")), Not(HasSubstr("libav"))));
}

TEST(Codecs, ThatAreNotThereEndOnlyWhatNeedsThem) {
  const TemporaryFolder folder;
  fs::copy_file(sdmt_words({})[0], folder / "sdmt");
  EXPECT_EQ(run_command({folder / "sdmt", "--version"}).exit_code, 0);
  const auto made = run_sdmt({"synth", "reid", "--output", folder / "reid", "--identities", "4"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  reid::testing_support::write_formula_model(folder / "m.safetensors");
  const auto without_codecs = [&](std::vector<std::string> words) {
    words.insert(words.begin(), folder / "sdmt");
    return run_command(words);
  };
  const auto jpegs = without_codecs({"validate-roc", "--data", folder / "reid", "--model",
                                     folder / "m.safetensors", "--json", folder / "v.json"});
  EXPECT_EQ(jpegs.exit_code, 0) << jpegs.err;

  write_file(folder / "picture.ppm", "P3 1 1 255 1 2 3\n");
  const auto result = without_codecs({"embed", folder / "picture.ppm", "--model",
                                      folder / "m.safetensors", "--output", folder / "e"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err,
              AllOf(HasSubstr("sdmt-codecs.so, by which images and videos are read and written, "
                              "cannot be loaded: "),
                    EndsWith("; is sdmt installed as a whole?\n")));
  EXPECT_FALSE(fs::exists(folder / "e"));
}

}  // namespace
}  // namespace sdmt::tests
