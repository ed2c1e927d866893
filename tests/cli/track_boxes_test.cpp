// SPDX-License-Identifier: Apache-2.0
// sdmt track with boxes of others: in every spelling, and live through a pipe.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>

#include "cli/track_scene.h"
#include "pipeline/made_network.h"
#include "sdmt/mot/mot_file.h"

namespace sdmt::tests {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class TrackBoxes : public TrackScene {};

TEST_F(TrackBoxes, EverySpellingGivesTheSameTracks) {
  const std::string scene = motion_sequence("scene", 30, 3);
  ASSERT_EQ(track(scene, {"--no-appearance"}).exit_code, 0);
  const std::string expected = tracks();
  ASSERT_NE(expected, "");
  const auto file = mot::DetectionFile::read(scene + "/det/det.txt");
  std::string csv = "frame,x,y,w,h,conf\n", lines, kitti, coco;
  for (int frame = 1; frame <= file.last_frame(); ++frame) {
    std::string boxes, scores, yolo;
    for (const auto& [box, score] : file.frame(frame)) {
      const auto text = [](std::initializer_list<double> values, const char* separator) {
        std::string all;
        for (const double value : values) {
          char number[40];
          std::snprintf(number, sizeof number, "%s%.17g", all.empty() ? "" : separator, value);
          all += number;
        }
        return all;
      };
      const auto number = std::to_string(frame);
      csv += text({1.0 * frame, box.left, box.top, box.width, box.height, score}, ",") + "\n";
      boxes += (boxes.empty() ? "[" : ",[") +
               text({box.left, box.top, box.width, box.height}, ",") + "]";
      scores += (scores.empty() ? "" : ",") + text({score}, "");
      kitti += std::to_string(frame - 1) + " -1 Pedestrian 0 0 -10 " +
               text({box.left - 1, box.top - 1, box.left + box.width - 1, box.top + box.height - 1},
                    " ") +
               " -1 -1 -1 -1000 -1000 -1000 -10 " + text({score}, "") + "\n";
      coco += std::string(coco.empty() ? "[" : ",\n") + "{\"image_id\":" + number +
              ",\"category_id\":1,\"bbox\":[" +
              text({box.left - 1, box.top - 1, box.width, box.height}, ",") +
              "],\"score\":" + text({score}, "") + "}";
      yolo += "0 " +
              text({(box.left - 1 + box.width / 2) / 1000, (box.top - 1 + box.height / 2) / 500,
                    box.width / 1000, box.height / 500, score},
                   " ") +
              "\n";
    }
    lines += "{\"frame\":" + std::to_string(frame) + ",\"boxes\":[" + boxes + "],\"scores\":[" +
             scores + "]}\n";
    std::filesystem::create_directories(folder_ / "yolo");
    write_file(folder_ / ("yolo/" + std::to_string(frame) + ".txt"), yolo);
  }
  write_file(folder_ / "boxes.csv", csv);
  write_file(folder_ / "boxes.jsonl", lines);
  write_file(folder_ / "kitti.txt", kitti);
  write_file(folder_ / "coco.json", coco + "]");
  for (const char* name : {"boxes.csv", "boxes.jsonl", "kitti.txt", "coco.json", "yolo"}) {
    const auto result = track(scene, {"--no-appearance", "--detections", folder_ / name});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(tracks(), expected) << name;
  }
}

// A line in, a line out, before the next one is written.
TEST_F(TrackBoxes, LiveBoxesAreAnsweredAtOnce) {
  const auto pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), S_IRUSR | S_IWUSR), 0);
  std::string command;
  for (const auto& word :
       sdmt_words({"track", "-", "--detections", "-", "--no-appearance", "--delay", "0",
                   "--min-length", "1", "--max-misses", "1", "--jsonl", "-"})) {
    command += "'" + word + "' ";
  }
  Process process({"/bin/sh", "-c", command + "< '" + pipe.string() + "'"});
  std::ofstream boxes(pipe);
  for (int frame = 1; frame <= 5; ++frame) {
    boxes << "{\"boxes\":[[" << 10 + frame << ",20,30,60]],\"scores\":[0.9]}" << std::endl;
    EXPECT_THAT(process.read_line(), StartsWith("{\"version\":1,\"source\":\"-\",\"frame\":" +
                                                std::to_string(frame) + ",\"tracks\":[{\"id\":1,"));
  }
  boxes << "{\"boxes\":[[1,2]]}" << std::endl;
  boxes.close();
  const auto result = process.wait();
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("standard input:6: boxes[0] is [1,2], expected [left, top"));
}

// Somebody walks on while half a second is lost.
TEST_F(TrackBoxes, TimesOfAFileTellHowFarPeopleGot) {
  std::string lines;
  for (int frame = 1; frame <= 40; ++frame) {
    const int at = frame <= 20 ? frame : frame + 5;
    lines += "{\"boxes\":[[" + std::to_string(10 + 9 * at) +
             ",20,30,60]],\"scores\":[0.9],\"time\":" + std::to_string(0.1 * at) + "}\n";
  }
  write_file(folder_ / "boxes.jsonl", lines);
  const std::string scene = motion_sequence("scene", 40, 1);
  const auto ids = [&](const std::vector<std::string>& words) {
    std::vector<std::string> all{"--no-appearance", "--no-association", "--detections",
                                 folder_ / "boxes.jsonl"};
    all.insert(all.end(), words.begin(), words.end());
    EXPECT_EQ(track(scene, all).exit_code, 0);
    std::set<int> seen;
    for (const auto& row : mot::read_results(folder_ / "tracks.txt")) seen.insert(row.id);
    return seen.size();
  };
  EXPECT_EQ(ids({}), 2u);
  EXPECT_EQ(ids({"--frame-rate", "10"}), 1u);
}

// Two people meet and turn back where motion has them pass each other; the one at the right keeps
// the id by the vectors.
TEST_F(TrackBoxes, GivenEmbeddingsTakeThePlaceOfOurs) {
  std::string lines;
  for (int frame = 1; frame <= 20; ++frame) {
    const int a = frame <= 10 ? 10 + 6 * frame : 130 - 6 * frame;
    const int b = 140 - a;
    lines += "{\"boxes\":[[" + std::to_string(a) + ",20,30,60],[" + std::to_string(b) +
             ",20,30,60]],\"scores\":[0.9,0.9],\"embeddings\":[[1,0,0],[0,1,0]]}\n";
  }
  write_file(folder_ / "boxes.jsonl", lines);
  const std::string scene = motion_sequence("scene", 20, 1);
  const auto refused = track(scene, {"--detections", folder_ / "boxes.jsonl"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("expected --tau-a T"));
  const auto id_at_the_right = [&](int frame) {
    const auto rows = mot::read_results(folder_ / "tracks.txt");
    int id = 0;
    double left = -1;
    for (const auto& row : rows) {
      if (row.frame != frame || row.box.left <= left) continue;
      left = row.box.left;
      id = row.id;
    }
    return id;
  };
  const auto by_vectors = track(scene, {"--detections", folder_ / "boxes.jsonl", "--tau-a", "0.5",
                                        "--nms", "1", "--min-iou", "0"});
  ASSERT_EQ(by_vectors.exit_code, 0) << by_vectors.err;
  EXPECT_NE(id_at_the_right(1), 0);
  EXPECT_EQ(id_at_the_right(1), id_at_the_right(20));
}

TEST_F(TrackBoxes, DetectKeepsBoxesThatTrackReads) {
  const std::string scene = picture_sequence("scene", 4);
  for (const char* name : {"boxes.txt", "boxes.jsonl"}) {
    const auto kept = run_sdmt({"detect", scene, "--detector", "hog", "--output", folder_ / name});
    ASSERT_EQ(kept.exit_code, 0) << kept.err;
    ASSERT_EQ(track(scene, {"--no-appearance", "--min-length", "1", "--detections", folder_ / name})
                  .exit_code,
              0);
    write_file(folder_ / (std::string(name) + ".tracks"), tracks());
  }
  EXPECT_EQ(read_file(folder_ / "boxes.txt.tracks"), read_file(folder_ / "boxes.jsonl.tracks"));
  const auto compared =
      run_sdmt({"detect", scene, "--compare", "hog", folder_ / "boxes.txt", "--score", "0"});
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_THAT(compared.out, HasSubstr("recall"));
  const auto row = [&](const std::string& name) {  // but for the name and the time
    std::istringstream rest(compared.out.substr(compared.out.find("\n" + name) + 1 + name.size()));
    std::vector<std::string> cells(5);
    for (std::string& cell : cells) rest >> cell;
    return cells;
  };
  EXPECT_EQ(row("hog"), row("boxes.txt")) << compared.out;
  EXPECT_EQ(run_sdmt({"detect", scene}).exit_code, 2);
  const auto sized = run_sdmt({"detect", scene, "--compare", "net.onnx@big"});
  EXPECT_EQ(sized.exit_code, 2);
  EXPECT_THAT(sized.err, HasSubstr("net.onnx@big': expected pixels after the @"));
}

TEST_F(TrackBoxes, ADetectorThatFailsLosesNothing) {
  std::filesystem::create_directories(folder_ / "frames");
  for (int frame = 1; frame <= 5; ++frame) {
    const cv::Mat grey(frame == 5 ? 240 : 320, 320, CV_8UC3, cv::Scalar::all(90));
    cv::imwrite(folder_ / ("frames/" + std::to_string(frame) + ".png"), grey);
  }
  const std::string network = make_fragile_darknet(folder_.path());
  const auto detected = run_sdmt(
      {"detect", folder_ / "frames", "--detector", network, "--output", folder_ / "boxes.txt"});
  if (detected.err.find("no dnn module") != std::string::npos) GTEST_SKIP() << detected.err;
  const auto expect_failure = [](const CommandResult& result) {
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, HasSubstr("fragile.cfg: the network failed in frame 5: "));
  };
  expect_failure(detected);
  EXPECT_EQ(mot::DetectionFile::read(folder_ / "boxes.txt").last_frame(), 4);
  expect_failure(track(folder_ / "frames", {"--detector", network, "--no-appearance", "--no-scores",
                                            "--delay", "0", "--min-length", "1"}));
  const auto rows = mot::read_results(folder_ / "tracks.txt");
  ASSERT_FALSE(rows.empty());
  EXPECT_EQ(rows.back().frame, 4);
}

}  // namespace
}  // namespace sdmt::tests
