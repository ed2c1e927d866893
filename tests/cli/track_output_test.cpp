// SPDX-License-Identifier: Apache-2.0
// What sdmt track leaves behind, also when something goes wrong on the way.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <opencv2/videoio.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "cli/track_scene.h"
#include "sdmt/mot/mot_file.h"

namespace sdmt::tests {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

class TrackOutput : public TrackScene {
 protected:
  void expect_no_temporary_files() const {
    for (const std::string& name : folder_.listing()) EXPECT_THAT(name, Not(HasSubstr("tmp")));
  }
};

TEST_F(TrackOutput, AllFormsAgree) {
  const auto scene = picture_sequence("s", 60);
  const auto result = track(scene, {"--appearance", "histogram", "--jsonl", folder_ / "t.jsonl",
                                    "--render", folder_ / "t.mp4", "--json", folder_ / "r.json",
                                    "--explain", folder_ / "e.csv", "--stats"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("ms/frame"));
  expect_no_temporary_files();

  const auto rows = mot::read_results(folder_ / "tracks.txt");
  ASSERT_GT(rows.size(), 60u);
  std::istringstream lines(read_file(folder_ / "t.jsonl"));
  std::string line;
  int frame = 0;
  std::size_t boxes = 0;
  std::set<int> ids;
  while (std::getline(lines, line)) {
    const auto object = json::parse(line);
    EXPECT_EQ(object["frame"], ++frame);
    EXPECT_TRUE(object["merges"].is_array());
    for (const auto& tracked : object["tracks"]) {
      const auto& row = rows.at(boxes++);
      EXPECT_EQ(row.frame, frame);
      EXPECT_EQ(tracked["id"], row.id);
      EXPECT_NEAR(tracked["box"][0].get<double>(), row.box.left, 0.006);
      EXPECT_NEAR(tracked["box"][3].get<double>(), row.box.height, 0.006);
      const auto source = tracked["source"].get<std::string>();
      EXPECT_TRUE(source == "detected" || source == "interpolated") << source;
      ids.insert(row.id);
    }
  }
  EXPECT_EQ(frame, 60);
  EXPECT_EQ(boxes, rows.size());

  const auto report = json::parse(read_file(folder_ / "r.json"));
  EXPECT_EQ(report["frames"], 60);
  EXPECT_EQ(report["tracks"], ids.size());
  EXPECT_GT(report["detections"], 60);
  EXPECT_GT(report["embedded"], 60);
  EXPECT_GT(report["hz"], 0);
  EXPECT_GE(report["hz_without_embedding"], report["hz"]);
  EXPECT_GT(report["peak_rss_mib"], 1);
  for (const char* stage : {"embed", "predict", "assign", "boost", "associate", "emit"}) {
    EXPECT_GE(report["stage_ms"][stage], 0) << stage;
  }

  cv::VideoCapture video((folder_ / "t.mp4").string());
  EXPECT_EQ(video.get(cv::CAP_PROP_FRAME_COUNT), 60);
  EXPECT_EQ(video.get(cv::CAP_PROP_FRAME_WIDTH), 320);
  EXPECT_THAT(read_file(folder_ / "e.csv"),
              HasSubstr("frame,older,newer,gap,affinity,threshold,verdict"));
}

TEST_F(TrackOutput, ThreadsAndDelayDoNotChangeAByte) {
  const auto scene = picture_sequence("s", 150);
  ASSERT_EQ(track(scene, {"--appearance", "histogram", "--threads", "1"}).exit_code, 0);
  const std::string expected = tracks();
  ASSERT_EQ(track(scene, {"--appearance", "histogram", "--threads", "2"}).exit_code, 0);
  EXPECT_EQ(tracks(), expected);
  ASSERT_EQ(track(scene, {"--appearance", "histogram", "--delay", "inf"}).exit_code, 0);
  EXPECT_EQ(tracks(), expected);
  ASSERT_EQ(track(scene, {"--appearance", "histogram", "--delay", "0"}).exit_code, 0);
  EXPECT_NE(tracks(), expected);
}

TEST_F(TrackOutput, PeopleAreWholeBeyondThePictureOfTheInput) {
  const auto sequence = motion_sequence("s", 100, 0);
  std::string boxes;
  for (int frame = 1; frame <= 100; ++frame) {
    const int left = 780 + 2 * frame, width = std::min(40, 1001 - left);
    boxes += std::to_string(frame) + ",-1," + std::to_string(left) + ",100," +
             std::to_string(width) + ",90,0.9\n";
  }
  write_file(folder_ / "det.txt", boxes);
  const auto rows = [&](const char* size) {
    const auto result =
        track(sequence, {"--no-appearance", "--detections", folder_ / "det.txt", "--amodal", size});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return tracks();
  };
  const auto farthest = [&](const char* size) {
    rows(size);
    double right = 0;
    for (const auto& row : mot::read_results(folder_ / "tracks.txt")) {
      right = std::max(right, row.box.left + row.box.width);
    }
    return right;
  };
  EXPECT_LT(farthest("off"), 1003);
  EXPECT_GT(farthest("auto"), 1010);
  EXPECT_EQ(rows("auto"), rows("1000x500"));

  write_file(folder_ / "s/seqinfo.ini", "[Sequence]\nname=s\nframeRate=25\nseqLength=100\n");
  const auto unknown =
      track(sequence, {"--no-appearance", "--detections", folder_ / "det.txt", "--amodal", "auto"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("expected --amodal off or WIDTHxHEIGHT"));
}

TEST_F(TrackOutput, AMissingFolderIsNoticedAtOnce) {
  const auto sequence = motion_sequence("s", 10, 1);
  for (const std::string option : {"--output", "--jsonl", "--json", "--explain"}) {
    const auto result =
        run_sdmt({"track", sequence, "--no-appearance", "--stats", option, folder_ / "no/file"});
    EXPECT_EQ(result.exit_code, 2) << option;
    EXPECT_THAT(result.err, HasSubstr("no/file")) << option;
  }
  const auto scene = picture_sequence("p", 2);
  const auto result =
      run_sdmt({"track", scene, "--no-appearance", "--render", folder_ / "no/v.mp4"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("no/v.mp4"));
}

TEST_F(TrackOutput, AFullDiskIsAFailureWhileRunning) {
  const auto sequence = motion_sequence("s", 400, 3);
  for (const std::string option : {"--output", "--jsonl", "--json", "--explain"}) {
    const auto result =
        run_sdmt({"track", sequence, "--no-appearance", "--stats", option, "/dev/full"});
    EXPECT_EQ(result.exit_code, 1) << option << result.err;
    EXPECT_THAT(result.err, HasSubstr("/dev/full")) << option;
  }
}

TEST_F(TrackOutput, AnErrorLeavesAnOlderFileAsItWas) {
  const auto scene = picture_sequence("s", 3);
  write_file(folder_ / "tracks.txt", "older\n");
  for (int frame = 1; frame <= 3; ++frame) {
    write_file(folder_ / ("s/img1/00000" + std::to_string(frame) + ".jpg"), "no");
  }
  EXPECT_EQ(track(scene, {"--appearance", "histogram"}).exit_code, 2);
  EXPECT_EQ(tracks(), "older\n");
  expect_no_temporary_files();
}

TEST_F(TrackOutput, CtrlCWritesWhatIsFinal) {
  // The output does not fit the pipe, so that the command waits for us with most of it undone.
  const auto sequence = motion_sequence("s", 20000, 3);
  for (const int signal : {SIGINT, SIGTERM}) {
    Process process(sdmt_words({"track", sequence, "--no-appearance", "--jsonl", "-", "--output",
                                folder_ / "tracks.txt"}));
    EXPECT_EQ(json::parse(process.read_line())["frame"], 1);
    process.send_signal(signal);
    const auto result = process.wait();
    EXPECT_EQ(result.exit_code, 128 + signal) << result.err;
    const auto rows = mot::read_results(folder_ / "tracks.txt");
    ASSERT_FALSE(rows.empty());
    EXPECT_LT(rows.back().frame, 20000);
    // The last line is whole, and both outputs end with the same frame.
    const auto last = result.out.rfind('\n', result.out.size() - 2);
    EXPECT_EQ(json::parse(result.out.substr(last + 1))["frame"], rows.back().frame);
    expect_no_temporary_files();
  }
}

TEST_F(TrackOutput, NoOutputMayBeAnInputOrAnotherOutput) {
  const auto sequence = motion_sequence("s", 10, 1);
  const std::string detections = sequence + "/det/det.txt";
  const std::string before = read_file(detections);
  const auto onto_input = run_sdmt(
      {"track", sequence, "--no-appearance", "--output", sequence + "/img1/../det/det.txt"});
  EXPECT_EQ(onto_input.exit_code, 2);
  EXPECT_THAT(onto_input.err, HasSubstr("is read as --detections, expected another file"));
  EXPECT_EQ(read_file(detections), before);
  const auto twice = track(sequence, {"--no-appearance", "--jsonl", folder_ / "tracks.txt"});
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_THAT(twice.err, HasSubstr("is written by --output, expected another file"));
  EXPECT_FALSE(has_tracks());
}

TEST_F(TrackOutput, AFrameThatIsOnlyDrawnIsNamedAndCounted) {
  const auto scene = picture_sequence("s", 12);
  write_file(folder_ / "s/img1/000006.jpg", "not a JPEG");
  std::filesystem::remove(folder_ / "s/img1/000009.jpg");
  const auto result = track(
      scene, {"--no-appearance", "--render", folder_ / "v.avi", "--json", folder_ / "r.json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("000006.jpg: not a readable image; it is drawn grey"));
  EXPECT_THAT(result.err, HasSubstr("000009.jpg: does not exist; it is drawn grey"));
  EXPECT_EQ(json::parse(read_file(folder_ / "r.json"))["unreadable_frames"], 2);
}

TEST_F(TrackOutput, AVideoThatDoesNotFitTheDiskTakesNothingElseAlong) {
  const auto scene = picture_sequence("s", 40);
  for (const std::string video : {"v.mp4", "v.mkv", "v.MOV", "v.avi"}) {
    SCOPED_TRACE(video);
    std::filesystem::remove(folder_ / "tracks.txt");
    // Blocks of 1024 bytes: room for the text, not for the video.
    const auto result = run_command({"/bin/sh", "-c", "ulimit -f 40; exec \"$@\"", "sh",
                                     SDMT_BINARY, "track", scene, "--no-appearance", "--output",
                                     folder_ / "tracks.txt", "--render", folder_ / video});
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr("writing failed"));
    EXPECT_EQ(mot::read_results(folder_ / "tracks.txt").back().frame, 40);
    EXPECT_FALSE(std::filesystem::exists(folder_ / video));
    expect_no_temporary_files();
  }
}

TEST_F(TrackOutput, LibrariesDoNotWriteToStandardError) {
  if (kSanitized) GTEST_SKIP() << "standard error is left to the sanitizers";
  const auto scene = picture_sequence("s", 3);
  // A JPEG with a damaged middle: libjpeg has something to say about it, and decodes it.
  std::string bytes = read_file(folder_ / "s/img1/000002.jpg");
  for (std::size_t i = bytes.size() / 2; i < bytes.size() / 2 + 40; ++i) bytes[i] = '\x55';
  write_file(folder_ / "s/img1/000002.jpg", bytes);
  const auto result = track(scene, {"--appearance", "histogram"});
  EXPECT_EQ(result.exit_code, 0);
  std::istringstream lines(result.err);
  for (std::string line; std::getline(lines, line);)
    EXPECT_THAT(line, HasSubstr("tracking")) << line;
}

TEST_F(TrackOutput, ARunThatWasKilledGoesOnWithTheSameBytes) {
  const auto scene = picture_sequence("s", 150);
  const std::vector<std::string> wanted = {"--appearance",      "histogram", "--jsonl",
                                           folder_ / "t.jsonl", "--state",   folder_ / "state",
                                           "--state-every",     "10"};
  const auto run = [&](const std::string& threads) {
    auto words = wanted;
    words.insert(words.end(), {"--threads", threads});
    return track(scene, words);
  };
  ASSERT_EQ(run("2").exit_code, 0);
  const auto expected = tracks() + read_file(folder_ / "t.jsonl");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "state"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "state.frames"));

  std::filesystem::remove(folder_ / "tracks.txt");
  std::filesystem::remove(folder_ / "t.jsonl");
  std::vector<std::string> words = {SDMT_BINARY, "track", scene, "--output", folder_ / "tracks.txt",
                                    "--threads", "1"};
  words.insert(words.end(), wanted.begin(), wanted.end());
  int kills = 0;
  for (int kill = 0; kill < 3; ++kill) {
    // The state of each try differs from that of the one before when it got a little further.
    const std::string before =
        std::filesystem::exists(folder_ / "state") ? read_file(folder_ / "state") : "";
    Process process(words);
    for (int wait = 0; wait < 2000 && std::filesystem::exists(folder_ / "tracks.txt") == false;
         ++wait) {
      std::error_code gone;
      if (std::filesystem::file_size(folder_ / "state", gone) > 0 && !gone &&
          read_file(folder_ / "state") != before) {
        break;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    process.send_signal(SIGKILL);
    kills += process.wait().exit_code == 128 + SIGKILL ? 1 : 0;
  }
  EXPECT_GE(kills, 1);
  auto other = wanted;
  other.insert(other.end(), {"--lambda", "0.4"});
  if (std::filesystem::exists(folder_ / "state")) {
    EXPECT_EQ(track(scene, other).exit_code, 2);
  }
  ASSERT_EQ(run("2").exit_code, 0);
  EXPECT_EQ(tracks() + read_file(folder_ / "t.jsonl"), expected);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "state"));
  EXPECT_EQ(track(scene, {"--state", folder_ / "state", "--explain", folder_ / "e"}).exit_code, 2);
}

}  // namespace
}  // namespace sdmt::tests
