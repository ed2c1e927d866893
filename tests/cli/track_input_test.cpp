// SPDX-License-Identifier: Apache-2.0
// What sdmt track says about input that is wrong, and what it bears.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "cli/track_scene.h"
#include "sdmt/mot/mot_file.h"

namespace sdmt::tests {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::vector<std::string> kMotion{"--no-appearance"};

class TrackInput : public TrackScene {
 protected:
  // Bad input: exit code 2, one line that holds all of `parts`, no output.
  void expect_refused(const CommandResult& result, const std::vector<std::string>& parts) {
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_TRUE(result.err.starts_with("sdmt track: ")) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    for (const std::string& part : parts) EXPECT_THAT(result.err, HasSubstr(part));
    EXPECT_FALSE(has_tracks());
    for (const std::string& name : folder_.listing()) EXPECT_THAT(name, Not(HasSubstr("tmp")));
  }

  CommandResult track_rows(const std::string& rows) {
    const auto sequence = motion_sequence("s", 10, 1);
    write_file(folder_ / "det.txt", rows);
    return track(sequence, {"--no-appearance", "--detections", folder_ / "det.txt"});
  }
};

TEST_F(TrackInput, WhatIsNotThere) {
  expect_refused(track(folder_ / "nothing", kMotion), {"nothing", "does not exist"});
  const auto sequence = motion_sequence("s", 10, 1);
  expect_refused(track(sequence, {"--no-appearance", "--detections", folder_ / "no.txt"}),
                 {"no.txt"});
  expect_refused(track(sequence, {"--model", folder_ / "no.safetensors"}), {"no frames"});
  expect_refused(track("camera:x", kMotion), {"camera:x"});
  std::filesystem::create_directories(folder_ / "empty");
  expect_refused(track(folder_ / "empty", kMotion), {"empty", "images"});
  write_file(folder_ / "text.mp4", "this is no video");
  expect_refused(track(folder_ / "text.mp4", kMotion), {"text.mp4", "not a video"});
}

TEST_F(TrackInput, DetectionsWithoutTracksAreExplained) {
  const auto rows = [](const char* score, int frames) {
    std::string text;
    for (int frame = 1; frame <= frames; ++frame) {
      text += std::to_string(frame) + ",-1,20,20,30,60," + score + "\n";
      text += std::to_string(frame) + ",-1,200,20,30,60,0.1\n";
    }
    return text;
  };
  EXPECT_THAT(track_rows(rows("0.9", 3)).out, HasSubstr("no tracks: none of 1 candidates"));
  EXPECT_THAT(track_rows(rows("0.3", 10)).out, HasSubstr("see --strong-confidence"));
  EXPECT_THAT(track_rows(rows("0.9", 10)).out, Not(HasSubstr("no tracks")));
}

TEST_F(TrackInput, BoxesInFractionsAreRecognised) {
  std::string rows;
  for (int frame = 1; frame <= 10; ++frame) {
    rows += std::to_string(frame) + ",-1,0.2,0.3,0.1,0.4,0.9\n";
  }
  EXPECT_THAT(track_rows(rows).err, HasSubstr("warning: " + (folder_ / "det.txt").string() +
                                              ": all boxes lie within 0..1"));
}

TEST_F(TrackInput, BrokenModels) {
  const auto scene = picture_sequence("s", 3);
  expect_refused(track(scene, {"--model", folder_ / "no.safetensors"}), {"no.safetensors"});
  write_file(folder_ / "short.safetensors", std::string("\x10\0\0\0", 4));
  expect_refused(track(scene, {"--model", folder_ / "short.safetensors"}), {"short.safetensors"});
  write_file(folder_ / "huge.safetensors", std::string(8, '\x7f') + "{}");
  expect_refused(track(scene, {"--model", folder_ / "huge.safetensors"}), {"huge.safetensors"});
  const std::string header = R"({"features.0.weight":{"dtype":"F32","shape":[64,3,3,3],)"
                             R"("data_offsets":[0,6912]}})";
  std::string length(8, '\0');
  length[0] = static_cast<char>(header.size());
  write_file(folder_ / "cut.safetensors", length + header + "only a few bytes");
  expect_refused(track(scene, {"--model", folder_ / "cut.safetensors"}), {"cut.safetensors"});
}

TEST_F(TrackInput, BadDetectionRowsAreNamedByLine) {
  const std::vector<std::pair<std::string, std::string>> rows{
      {"2,-1,10,10,nan,90,1", "nan"},     {"2,-1,inf,10,40,90,1", "inf"},
      {"2,-1,10,10,-3,90,1", "width"},    {"2,-1,10,10,40,0,1", "height"},
      {"2,-1,10,10,forty,90,1", "forty"}, {"2,-1,10,10,40", "height is missing"},
      {"0,-1,10,10,40,90,1", "frame"},
  };
  for (const auto& [row, part] : rows) {
    SCOPED_TRACE(row);
    expect_refused(track_rows("1,-1,10,10,40,90,1\n" + row + "\n"), {"det.txt:2:", part});
  }
}

TEST_F(TrackInput, UnsortedFramesAndCarriageReturnsDoNotMatter) {
  const std::string forward =
      "1,-1,10,10,40,90,.9\n2,-1,11,10,40,90,.8\n3,-1,12,10,40,90,.9\n4,-1,13,10,40,90,.9\n"
      "5,-1,14,10,40,90,.9\n6,-1,15,10,40,90,.9\n";
  ASSERT_EQ(track_rows(forward).exit_code, 0);
  const std::string expected = tracks();
  EXPECT_THAT(expected, HasSubstr("6,1,"));
  const std::string shuffled =
      "5,-1,14,10,40,90,.9\r\n2,-1,11,10,40,90,.8\r\n6,-1,15,10,40,90,.9\r\n1,-1,10,10,40,90,.9\r\n"
      "4,-1,13,10,40,90,.9\r\n\r\n3,-1,12,10,40,90,.9";
  ASSERT_EQ(track_rows(shuffled).exit_code, 0);
  EXPECT_EQ(tracks(), expected);
}

TEST_F(TrackInput, AnEmptyDetectionFileHasNoTracks) {
  const auto result = track_rows("");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(tracks(), "");
  EXPECT_THAT(result.out, HasSubstr("10 frames, 0 detections, 0 tracks"));
  EXPECT_THAT(result.out, HasSubstr("no tracks: nobody was detected"));
}

TEST_F(TrackInput, SequencesWithoutFramesSayWhatCannotWork) {
  const auto sequence = motion_sequence("s", 30, 2);
  expect_refused(track(sequence, {}), {"no frames", "--no-appearance"});
  expect_refused(track(sequence, {"--no-appearance", "--detections", "hog"}),
                 {"no frames", "--detections FILE"});
  expect_refused(track(sequence, {"--no-appearance", "--render", folder_ / "v.mp4"}),
                 {"no frames", "--render"});
  EXPECT_EQ(track(sequence, kMotion).exit_code, 0);
}

TEST_F(TrackInput, BoxesFarOutsideOrHugeAreBorne) {
  const auto scene = picture_sequence("s", 8);
  std::string rows;
  for (int frame = 1; frame <= 8; ++frame) {
    const std::string f = std::to_string(frame);
    rows += f + ",-1,1e9,1e9,40,90,.9\n" + f + ",-1,-500,-500,1e9,1e9,.8\n" + f +
            ",-1,-2147483648,10,40,90,.9\n" + f + ",-1,100,50,0.001,0.001,.9\n" + f +
            ",-1,100,50,40,90,.9\n";
  }
  write_file(folder_ / "det.txt", rows);
  const auto result =
      track(scene, {"--appearance", "histogram", "--detections", folder_ / "det.txt", "--boosting",
                    "--render", folder_ / "v.mp4"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(tracks(), AllOf(HasSubstr("8,"), Not(HasSubstr("nan")), Not(HasSubstr("inf"))));
}

TEST_F(TrackInput, TinyImagesAreBorne) {
  for (const cv::Size size : {cv::Size(1, 1), cv::Size(200, 1), cv::Size(1, 200)}) {
    const std::string images = folder_ / ("i" + std::to_string(size.width + 1000 * size.height));
    std::filesystem::create_directories(images);
    std::string rows;
    for (int frame = 1; frame <= 8; ++frame) {
      cv::imwrite(images + "/" + std::to_string(frame) + ".png",
                  cv::Mat(size, CV_8UC3, cv::Scalar(10, 200, 90)));
      rows += std::to_string(frame) + ",-1,1,1,40,90,.9\n";
    }
    write_file(folder_ / "det.txt", rows);
    auto result = track(images, {"--appearance", "histogram", "--detections", folder_ / "det.txt"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(tracks(), HasSubstr("8,1,"));
    result = track(images, {"--appearance", "histogram"});  // the people detector's turn
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
}

TEST_F(TrackInput, AnUnreadableFrameIsNamedAndCounted) {
  const auto scene = picture_sequence("s", 12);
  write_file(folder_ / "s/img1/000006.jpg", "not a JPEG");
  std::filesystem::remove(folder_ / "s/img1/000009.jpg");
  const auto result = track(scene, {"--appearance", "histogram", "--json", folder_ / "r.json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("000006.jpg"), HasSubstr("000009.jpg")));
  const auto report = nlohmann::json::parse(read_file(folder_ / "r.json"));
  EXPECT_EQ(report["frames"], 12);
  EXPECT_EQ(report["unreadable_frames"], 2);
}

TEST_F(TrackInput, WithoutItsFirstFrameASequenceStillHasFrames) {
  const auto scene = picture_sequence("s", 5);
  std::filesystem::remove(folder_ / "s/img1/000001.jpg");
  const auto result = track(scene, {"--appearance", "histogram"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("000001.jpg: does not exist"));
  EXPECT_THAT(result.out, HasSubstr("1 frames were unreadable"));
}

TEST_F(TrackInput, NothingReadableIsAnError) {
  const auto scene = picture_sequence("s", 3);
  for (int frame = 1; frame <= 3; ++frame) {
    write_file(folder_ / ("s/img1/00000" + std::to_string(frame) + ".jpg"), "no");
  }
  const auto result = track(scene, {"--appearance", "histogram"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("none of the 3 frames could be read"));
  EXPECT_FALSE(has_tracks());
}

TEST_F(TrackInput, ImageFoldersAreReadInNaturalOrder) {
  const std::string images = folder_ / "images";
  std::filesystem::create_directories(images);
  for (int frame = 1; frame <= 11; ++frame) {
    // Brighter and brighter; alphabetically 10.png and 11.png would come second.
    cv::imwrite(images + "/" + std::to_string(frame) + ".png",
                cv::Mat(120, 160, CV_8UC3, cv::Scalar::all(20.0 * frame)));
  }
  write_file(folder_ / "det.txt", "");
  const auto result = track(images, {"--no-appearance", "--detections", folder_ / "det.txt",
                                     "--render", folder_ / "v.avi"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  cv::VideoCapture video((folder_ / "v.avi").string());
  cv::Mat image;
  for (int frame = 1; frame <= 11; ++frame) {
    ASSERT_TRUE(video.read(image));
    EXPECT_NEAR(cv::mean(image.rowRange(0, 60))[1], 20 * frame, 4) << frame;
  }
}

TEST_F(TrackInput, OptionsOutOfRangeAreNamed) {
  const auto sequence = motion_sequence("s", 10, 1);
  expect_refused(track(sequence, {"--no-appearance", "--lambda", "2"}), {"lambda", "2"});
  expect_refused(track(sequence, {"--no-appearance", "--delay", "soon"}), {"delay", "soon"});
  expect_refused(track(sequence, {"--no-appearance", "--nms", "wide"}), {"nms", "wide"});
  expect_refused(track(sequence, {"--no-appearance", "--calibration", "x"}), {"calibration"});
  expect_refused(track(sequence, {"--no-appearance", "--tau-a", "2"}), {"--tau-a", "2", "< 1"});
  write_file(folder_ / "c.json", R"({"gallery-size": 0})");
  expect_refused(track(sequence, {"--no-appearance", "--config", folder_ / "c.json"}),
                 {"--gallery-size", "is 0, expected 1..1000", "(set in ", "c.json"});
  const auto idle = run_sdmt({"track", sequence, "--no-appearance"});
  EXPECT_EQ(idle.exit_code, 2);
  EXPECT_THAT(idle.err, HasSubstr("--output"));
}

TEST_F(TrackInput, RawScoresAndMissingScoresAreMentioned) {
  EXPECT_THAT(track_rows("1,-1,10,10,40,90,-1\n2,-1,11,10,40,90,-1\n").err,
              HasSubstr("all scores are equal"));
  EXPECT_THAT(track_rows("1,-1,10,10,40,90,-1\n2,-1,11,10,40,90,42\n").err,
              HasSubstr("--calibration"));
}

TEST_F(TrackInput, WhatTheTrackerCannotTakeIsNamedByLine) {
  expect_refused(track_rows("1,-1,10,10,40,90,1\n2,-1,1e300,10,40,90,1\n"),
                 {"det.txt:2: left is 1e+300, expected -1e12..1e12"});
}

TEST_F(TrackInput, AByteOrderMarkDoesNotMatter) {
  const auto result = track_rows(
      "\xEF\xBB\xBF"
      "1,-1,10,10,40,90,1\n2,-1,10,10,40,90,.9\n");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("2 detections"));
}

TEST_F(TrackInput, AVideoThatEndsEarlyIsMentioned) {
  const auto sequence = motion_sequence("s", 40, 1);
  {
    cv::VideoWriter video(folder_ / "v.avi", cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25,
                          {160, 120});
    for (int frame = 1; frame <= 40; ++frame) {
      video.write(cv::Mat(120, 160, CV_8UC3, cv::Scalar(0, 6.0 * frame, 90)));
    }
  }
  const std::vector<std::string> words{"--no-appearance", "--detections",
                                       sequence + "/det/det.txt"};
  EXPECT_THAT(track(folder_ / "v.avi", words).err, Not(HasSubstr("damaged")));
  std::string bytes = read_file(folder_ / "v.avi");
  // Zeros over a stretch of it, as a bad copy leaves them: frames are lost, the length stays.
  std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2),
            bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() * 7 / 10), '\0');
  write_file(folder_ / "v.avi", bytes);
  const auto result = track(folder_ / "v.avi", words);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("of its 40 frames; it is damaged or incomplete"));
}

TEST_F(TrackInput, AModelWithoutThresholdIsMentioned) {
  const auto scene = picture_sequence("s", 2);
  ASSERT_EQ(run_sdmt({"init-model", "--output", folder_ / "m.safetensors"}).exit_code, 0);
  const std::vector<std::string> words{"--model", folder_ / "m.safetensors"};
  EXPECT_THAT(track(scene, words).err, HasSubstr("m.safetensors: holds no tau_a, 0.895 is taken"));
  auto given = words;
  given.insert(given.end(), {"--tau-a", "0.9"});
  EXPECT_THAT(track(scene, given).err, Not(HasSubstr("tau_a")));
}

}  // namespace
}  // namespace sdmt::tests
