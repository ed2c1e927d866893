// SPDX-License-Identifier: Apache-2.0
#include "retention.h"

#include <gtest/gtest.h>

#include "cli/run_command.h"

namespace sdmt::pipeline {
namespace {

namespace fs = std::filesystem;

TEST(Retention, RemovesOldFilesOfOneOutputAndNothingElse) {
  const tests::TemporaryFolder folder;
  const auto file = [&](const char* name, int hours) {
    tests::write_file(folder / name, "x");
    fs::last_write_time(folder / name,
                        fs::file_time_type::clock::now() - std::chrono::hours(hours));
  };
  const std::vector<const char*> kept{"tracks.jsonl",                      // still written
                                      "tracks.20260301T140509Z.csv",       // of another
                                      "other.20260301T140509Z.jsonl",      // of another
                                      "tracks.20260301T140509Z.jsonl.gz",  // somebody's
                                      "tracks.20260301.jsonl",             // somebody's
                                      "tracks.20260301T140509Z-.jsonl",    // somebody's
                                      "tracks.20260301T140509Z-b.jsonl",   // somebody's
                                      "tracks.20260301T1405x9Z.jsonl",     // somebody's
                                      "tracks-2.20260301T140509Z.jsonl"};  // of another
  for (const char* const name : kept) file(name, 50);
  file("tracks.20260301T140509Z.jsonl", 50);
  file("tracks.20260301T140509Z-2.jsonl", 49);
  file("tracks.20260303T140509Z.jsonl", 47);
  fs::create_directory(folder / "tracks.20260302T140509Z.jsonl");
  fs::create_symlink(folder / "tracks.jsonl", folder / "tracks.20260301T150509Z.jsonl");
  Retention retention(folder / "tracks.jsonl",
                      {.rotation = {},
                       .tell = [](const std::string& text) { FAIL() << text; },
                       .keep = 48. * 3600});
  retention.look();
  for (const char* const name : kept) EXPECT_TRUE(fs::exists(folder / name)) << name;
  EXPECT_FALSE(fs::exists(folder / "tracks.20260301T140509Z.jsonl"));
  EXPECT_FALSE(fs::exists(folder / "tracks.20260301T140509Z-2.jsonl"));
  EXPECT_TRUE(fs::exists(folder / "tracks.20260303T140509Z.jsonl"));
  EXPECT_TRUE(fs::is_directory(folder / "tracks.20260302T140509Z.jsonl"));
  EXPECT_TRUE(fs::exists(folder / "tracks.20260301T150509Z.jsonl"));
}

TEST(Retention, KeepsEverythingWhereNothingIsSaid) {
  const tests::TemporaryFolder folder;
  tests::write_file(folder / "t.20200301T140509Z.csv", "x");
  fs::last_write_time(folder / "t.20200301T140509Z.csv", fs::file_time_type::min());
  Retention(folder / "t.csv", {}).look();
  EXPECT_TRUE(fs::exists(folder / "t.20200301T140509Z.csv"));
}

}  // namespace
}  // namespace sdmt::pipeline
