// SPDX-License-Identifier: Apache-2.0
// The shipped presets of the tracker say what the library says.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "cli/run_command.h"
#include "sdmt/track/tracker_option_table.h"

namespace sdmt::tests {
namespace {

using track::TrackerOptions;

// What belongs to the detector and not to the tracker, so that a file for every detector can be
// given beside the preset.
const std::set<std::string> kOfTheDetector{"calibration", "scores"};

void expect_same(const std::string& file, const TrackerOptions& expected) {
  const auto preset = nlohmann::json::parse(read_file(SDMT_CONFIGS_DIR + ("/" + file)));
  TrackerOptions read;
  std::set<std::string> keys;
  for (const auto& [key, value] : preset.items()) keys.insert(key);
  for (const auto& entry : track::tracker_option_table()) {
    if (kOfTheDetector.contains(entry.name)) continue;
    ASSERT_EQ(keys.erase(entry.name), 1u) << file << " lacks " << entry.name;
    const auto& value = preset[entry.name];
    entry.set(read, value.is_string() ? value.get<std::string>() : value.dump());
    EXPECT_EQ(entry.get(read), entry.get(expected)) << file << ": " << entry.name;
  }
  EXPECT_TRUE(keys.empty()) << file << ": " << *keys.begin();
}

TEST(Presets, TunedIsTheDefault) { expect_same("track-tuned.json", TrackerOptions::tuned()); }
TEST(Presets, PaperIsThePaper) { expect_same("track-paper.json", TrackerOptions::paper()); }

TEST(Presets, EveryDetectorFileNamesAKnownCalibration) {
  for (const std::string name : {"frcnn", "acf", "synthetic"}) {
    const auto file = read_file(SDMT_CONFIGS_DIR + ("/detector-" + name + ".json"));
    EXPECT_EQ(nlohmann::json::parse(file), (nlohmann::json{{"calibration", name}}));
    EXPECT_TRUE(track::parse_calibration(name).has_value());
  }
}

}  // namespace
}  // namespace sdmt::tests
