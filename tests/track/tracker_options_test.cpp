// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/tracker_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdmt/track/tracker.h"
#include "sdmt/track/tracker_option_table.h"

namespace sdmt::track {
namespace {

TrackerOptions with(const std::string& name, const std::string& value) {
  TrackerOptions options;
  for (const auto& option : tracker_option_table()) {
    if (option.name == name) {
      option.set(options, value);
      return options;
    }
  }
  ADD_FAILURE() << "no option " << name;
  return options;
}

std::string error(const std::string& name, const std::string& value) {
  try {
    with(name, value).validate();
  } catch (const std::invalid_argument& failure) {
    return failure.what();
  }
  return "no error";
}

TEST(TrackerOptions, PresetsAreValid) {
  EXPECT_NO_THROW(TrackerOptions::tuned().validate());
  EXPECT_NO_THROW(TrackerOptions::online().validate());
  EXPECT_NO_THROW(TrackerOptions::paper().validate());
  EXPECT_EQ(TrackerOptions::paper().auto_delay(), 92 + 10 + 20);  // about four seconds
  EXPECT_THROW(Tracker(with("lambda", "2")), std::invalid_argument);
}

TEST(TrackerOptions, NamesFieldValueAndBound) {
  EXPECT_EQ(error("lambda", "1.5"), "lambda is 1.5, expected 0..1");
  EXPECT_EQ(error("min-iou", "1"), "min_iou is 1, expected >= 0 and < 1");
  EXPECT_EQ(error("max-misses", "0"), "max_misses is 0, expected 1..1000000");
  EXPECT_EQ(error("boost-grid", "4"), "boost_grid is 4, expected an odd number in 1..31");
  EXPECT_EQ(error("tau-a", "1"), "tau_a is 1, expected >= -1 and < 1");
  EXPECT_EQ(error("position-noise", "0"), "position_noise is 0, expected > 0 and <= 100");
  EXPECT_EQ(error("min-confidence", "nan"), "min_confidence is nan, expected a number");
  EXPECT_EQ(error("gallery-size", "1001"), "gallery_size is 1001, expected 1..1000");
  for (const char* size : {"640", "0x480", "640x", "640x480x2", "-1x-1", ""}) {
    EXPECT_EQ(error("amodal", size),
              std::string("amodal is '") + size +
                  "', expected off, auto or the picture's size as 1920x1080");
  }
  EXPECT_EQ(error("delay", "-3"), "delay is '-3', expected auto, inf or a number of frames >= 0");
  EXPECT_EQ(error("calibration", "1,0"),
            "calibration scale is 0.000000, expected a finite value > 0");
}

TEST(TrackerOptions, NoNumberIsAcceptedOutOfRange) {
  for (const auto& option : tracker_option_table()) {
    if (option.is_switch || std::string(option.name) == "delay") continue;
    TrackerOptions options;
    try {
      option.set(options, "nan");
      options.validate();
      ADD_FAILURE() << option.name << " takes NaN";
    } catch (const std::invalid_argument&) {
    }
  }
}

TEST(TrackerOptionTable, ReadsWhatItPrints) {
  std::set<std::string> names;
  for (const auto& option : tracker_option_table()) {
    EXPECT_TRUE(names.insert(option.name).second) << option.name;
    for (const TrackerOptions& preset : {TrackerOptions::tuned(), TrackerOptions::paper()}) {
      TrackerOptions options;
      option.set(options, option.get(preset));
      EXPECT_EQ(option.get(options), option.get(preset)) << option.name;
    }
    if (option.is_switch) {
      TrackerOptions options;
      option.set(options, "true");
      EXPECT_EQ(option.get(options), "true");
      option.set(options, "false");
      EXPECT_EQ(option.get(options), "false") << option.name;
    }
  }
}

TEST(TrackerOptionTable, ReadsEveryKindOfValue) {
  EXPECT_EQ(with("delay", "inf").output.delay, OutputOptions::kUnlimitedDelay);
  EXPECT_EQ(with("delay", "auto").output.delay, OutputOptions::kAutoDelay);
  EXPECT_EQ(with("delay", "12").output.delay, 12);
  EXPECT_EQ(with("min-confidence", "-inf").input.min_confidence,
            -std::numeric_limits<double>::infinity());
  EXPECT_EQ(with("tau-a", "0.9").appearance.tau_a, 0.9);
  EXPECT_EQ(with("tau-a", "auto").appearance.tau_a, std::nullopt);
  EXPECT_EQ(with("report", "detection").output.report, ReportBox::detection);
  EXPECT_EQ(with("calibration", "acf").input.calibration, (ScoreCalibration{20.5, 22.1}));
  EXPECT_EQ(error("report", "box"),
            "report is 'box', expected one of smoothed, filtered, detection");
  EXPECT_EQ(error("boosting", "yes"), "boosting is 'yes', expected true or false");
  EXPECT_EQ(error("lambda", "0.5x"), "lambda is '0.5x', expected a number");
  EXPECT_EQ(error("max-misses", "2.5"), "max-misses is '2.5', expected a whole number");
}

// The files in configs/ are the presets: whoever changes one must change the other.
TEST(TrackerOptionTable, ConfigFilesAreThePresets) {
  const std::pair<const char*, TrackerOptions> files[] = {
      {"track-tuned.json", TrackerOptions::tuned()},
      {"track-online.json", TrackerOptions::online()},
      {"track-paper.json", TrackerOptions::paper()}};
  for (const auto& [name, preset] : files) {
    const std::string path = std::string(SDMT_TESTS_DIR) + "/../configs/" + name;
    std::ifstream file(path);
    ASSERT_TRUE(file) << path;
    const auto config = nlohmann::json::parse(file);
    std::set<std::string> keys;
    for (const auto& [key, value] : config.items()) keys.insert(key);
    for (const auto& option : tracker_option_table()) {
      ASSERT_EQ(keys.erase(option.name), 1u) << name << " lacks " << option.name;
      const auto& value = config.at(option.name);
      TrackerOptions options;
      option.set(options, value.is_string() ? value.get<std::string>() : value.dump());
      EXPECT_EQ(option.get(options), option.get(preset)) << name << " " << option.name;
    }
    EXPECT_TRUE(keys.empty()) << name << " holds unknown " << *keys.begin();
  }
}

// The table of options in the documentation is this one's.
TEST(TrackerOptionTable, IsTheDocumentation) {
  const std::string path = std::string(SDMT_TESTS_DIR) + "/../docs/tracking.md";
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  EXPECT_THAT(text, ::testing::HasSubstr(tracker_option_table().markdown(
                        {{"tuned", TrackerOptions::tuned()}, {"paper", TrackerOptions::paper()}})))
      << path;
}

}  // namespace
}  // namespace sdmt::track
