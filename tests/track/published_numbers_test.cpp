// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "sdmt/eval/prepare.h"
#include "sdmt/eval/scores.h"
#include "sdmt/mot/mot_file.h"
#include "sdmt/mot/sequence.h"
#include "sdmt/track/bytetrack_baseline.h"
#include "sdmt/track/result_rows.h"
#include "sdmt/track/sort_baseline.h"
#include "sdmt/track/track_smoothing.h"
#include "sdmt/track/tracker.h"

// Scores on real sequences, which are not part of the project: skipped where they are absent.

namespace sdmt::track {
namespace {

namespace fs = std::filesystem;

const fs::path kData = SDMT_DATA_DIR;

eval::Scores evaluate(const fs::path& folder, const std::vector<mot::ResultRow>& rows,
                      eval::Benchmark benchmark) {
  const auto gt = eval::read_sequence_ground_truth(folder);
  const auto prepared =
      eval::prepare_sequence(gt, rows, "results", benchmark, eval::Compat::trackeval);
  return eval::score_sequence(prepared.similarities, eval::Compat::trackeval);
}

eval::Scores run_tracker(const fs::path& folder, const std::string& detections,
                         TrackerOptions options, eval::Benchmark benchmark) {
  const auto file = mot::DetectionFile::read(folder / "det" / detections);
  const auto sequence = mot::Sequence::read(folder);
  const int frames = std::max(sequence.length, file.last_frame());
  options.fit_to_picture({sequence.width, sequence.height}, sequence.name);
  Tracker tracker(options);
  std::vector<mot::ResultRow> rows;
  for (int frame = 1; frame <= frames; ++frame) {
    for (const auto& done : tracker.update(file.frame(frame))) append_results(done, rows);
  }
  for (const auto& done : tracker.finish()) append_results(done, rows);
  return evaluate(folder, rows, benchmark);
}

eval::Scores run_sort(const fs::path& folder, const std::string& detections = "det-frcnn.txt") {
  const auto file = mot::DetectionFile::read(folder / "det" / detections);
  SortTracker tracker;
  std::vector<mot::ResultRow> rows;
  for (int frame = 1; frame <= file.last_frame(); ++frame) {
    append_results(tracker.update(file.frame(frame)), rows);
  }
  return evaluate(folder, rows, eval::Benchmark::mot15);
}

void expect_counts(const eval::Scores& scores, int fp, int fn, int idsw) {
  EXPECT_EQ(scores.clear.clr_fp, fp);
  EXPECT_EQ(scores.clear.clr_fn, fn);
  EXPECT_EQ(scores.clear.idsw, idsw);
}

#define SKIP_WITHOUT(folder) \
  if (!fs::exists(folder)) GTEST_SKIP() << (folder) << " is not here"

TEST(PublishedNumbers, SortOnItsOwnDetections) {
  SKIP_WITHOUT(kData / "mot15");
  expect_counts(run_sort(kData / "mot15" / "TUD-Campus"), 15, 113, 6);
  expect_counts(run_sort(kData / "mot15" / "TUD-Stadtmitte"), 22, 295, 10);
}

std::vector<fs::path> sequences(const fs::path& folder) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (mot::Sequence::is_sequence(entry.path())) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<FinishedFrame> bytetrack_frames(const fs::path& folder, const std::string& detections,
                                            const std::string& calibration_name,
                                            const ByteTrackOptions& options) {
  const auto file = mot::DetectionFile::read(folder / "det" / detections);
  const auto calibration = parse_calibration(calibration_name);
  ByteTracker tracker(options);
  std::vector<FinishedFrame> frames;
  for (int frame = 1; frame <= file.last_frame(); ++frame) {
    std::vector<mot::Detection> calibrated;
    for (mot::Detection detection : file.frame(frame)) {
      detection.score = calibration->probability(detection.score);
      calibrated.push_back(detection);
    }
    frames.push_back(tracker.update(calibrated));
  }
  return frames;
}

eval::Scores score(const fs::path& folder, const std::vector<FinishedFrame>& frames) {
  std::vector<mot::ResultRow> rows;
  for (const auto& frame : frames) append_results(frame, rows);
  return evaluate(folder, rows, eval::Benchmark::mot15);
}

eval::Scores run_bytetrack(const fs::path& folder, bool fuse_scores) {
  return score(folder,
               bytetrack_frames(folder, "det-frcnn.txt", "frcnn", {.fuse_scores = fuse_scores}));
}

// The published implementation gave these on the same detections, with its own thresholds.
TEST(PublishedNumbers, ByteTrackOnCalibratedDetections) {
  SKIP_WITHOUT(kData / "mot15");
  const struct {
    bool fuse_scores;
    double pets_mota, pets_idf1;
    int pets_switches;
    double mota;
    int switches;
  } published[] = {{false, 0.647, 0.583, 50, 0.523, 217}, {true, 0.645, 0.511, 59, 0.522, 222}};
  for (const auto& expected : published) {
    const auto pets = run_bytetrack(kData / "mot15" / "PETS09-S2L1", expected.fuse_scores);
    EXPECT_NEAR(pets.clear.mota, expected.pets_mota, 0.0005);
    EXPECT_NEAR(pets.identity.idf1, expected.pets_idf1, 0.0005);
    EXPECT_EQ(pets.clear.idsw, expected.pets_switches);
    std::vector<eval::Scores> all;
    for (const auto& folder : sequences(kData / "mot15")) {
      all.push_back(run_bytetrack(folder, expected.fuse_scores));
    }
    const auto combined = eval::combine(all, eval::Compat::trackeval);
    EXPECT_NEAR(combined.clear.mota, expected.mota, 0.0005);
    EXPECT_EQ(combined.clear.idsw, expected.switches);
  }
}

// An independent rehearsal in Python, which smooths ByteTrack's filtered boxes and fills gaps of
// less than 20 frames, gave these for it without score fusion. Smoothing the detections is better.
TEST(PublishedNumbers, ByteTrackSmoothedAndFilled) {
  SKIP_WITHOUT(kData / "mot15");
  OutputOptions output;
  output.max_fill = 19;
  output.smoothing_position_noise = 1.0 / 200;
  output.smoothing_velocity_noise = 1.0 / 160;
  const auto folder = kData / "mot15" / "PETS09-S2L1";
  const auto run = [&](ReportBox report) {
    const auto frames = bytetrack_frames(folder, "det-frcnn.txt", "frcnn", {.report = report});
    return score(folder, smooth_tracks(frames, output, MotionOptions{}));
  };
  const auto filtered = run(ReportBox::filtered);
  EXPECT_NEAR(filtered.clear.mota, 0.741, 0.005);
  EXPECT_NEAR(filtered.identity.idf1, 0.627, 0.01);
  EXPECT_NEAR(static_cast<double>(filtered.clear.idsw), 28, 2);
  EXPECT_GT(run(ReportBox::detection).clear.mota, filtered.clear.mota);
}

// An independent rehearsal of the paper's motion-only rules in Python gave these.
TEST(PublishedNumbers, ThePaperWithoutAppearanceAndAssociation) {
  SKIP_WITHOUT(kData / "mot15");
  TrackerOptions options = TrackerOptions::paper();
  options.association.enabled = false;
  const auto run = [&](const char* name) {
    return run_tracker(kData / "mot15" / name, "det-frcnn.txt", options, eval::Benchmark::mot15);
  };
  expect_counts(run("TUD-Campus"), 30, 100, 7);
  expect_counts(run("TUD-Stadtmitte"), 26, 269, 11);
}

struct Summary {
  double mota;  ///< over all boxes
  double idf1;  ///< mean over sequences, weighted by ground-truth boxes
};

Summary summarise(const std::vector<fs::path>& folders, const std::string& detections,
                  const TrackerOptions& options, eval::Benchmark benchmark) {
  std::vector<eval::Scores> all;
  double sum = 0, boxes = 0;
  for (const auto& folder : folders) {
    all.push_back(run_tracker(folder, detections, options, benchmark));
    sum += all.back().identity.idf1 * static_cast<double>(all.back().count.gt_dets);
    boxes += static_cast<double>(all.back().count.gt_dets);
  }
  return {eval::combine(all, eval::Compat::trackeval).clear.mota, sum / boxes};
}

// One setting for all sequences; the bars are above ByteTrack's scores on the same detections,
// smoothed and filled alike.
TEST(PublishedNumbers, TunedByMotionAloneBeatsSortAndByteTrack) {
  SKIP_WITHOUT(kData / "mot15");
  TrackerOptions options;
  options.input.calibration = parse_calibration("frcnn");
  const Summary mot15 =
      summarise(sequences(kData / "mot15"), "det-frcnn.txt", options, eval::Benchmark::mot15);
  EXPECT_GE(mot15.mota, 0.582);
  EXPECT_GE(mot15.idf1, 0.63);
  options.input.calibration = parse_calibration("synthetic");
  const Summary mot16 =
      summarise(sequences(kData / "mot16"), "det-synthetic.txt", options, eval::Benchmark::mot16);
  EXPECT_GE(mot16.mota, 0.32);
  EXPECT_GE(mot16.idf1, 0.42);
  options.input.calibration.reset();
  const Summary mot17 =
      summarise(sequences(kData / "mot16"), "det-frcnn17.txt", options, eval::Benchmark::mot16);
  EXPECT_GE(mot17.mota, 0.525);
  EXPECT_GE(mot17.idf1, 0.585);
  // As MOT16 annotates people, whole beyond the border.
  options.output.amodal = OutputOptions::kInputSize;
  const Summary whole =
      summarise(sequences(kData / "mot16"), "det-frcnn17.txt", options, eval::Benchmark::mot16);
  EXPECT_GE(whole.mota, 0.53);
  EXPECT_GT(whole.idf1, mot17.idf1);
}

// ByteTrack's online output has MOTA 52.3 and IDF1 57.7 (by ground-truth boxes).
TEST(PublishedNumbers, OnlineIsNoWorseThanByteTrack) {
  SKIP_WITHOUT(kData / "mot15");
  TrackerOptions options = TrackerOptions::online();
  options.input.calibration = parse_calibration("frcnn");
  const Summary mot15 =
      summarise(sequences(kData / "mot15"), "det-frcnn.txt", options, eval::Benchmark::mot15);
  EXPECT_GE(mot15.mota, 0.522);
  EXPECT_GE(mot15.idf1, 0.577);
}

// A calibration fitted on one sequence misses the people of the others.
TEST(PublishedNumbers, TunedBeatsSortOnEverySequenceWithAcfDetections) {
  SKIP_WITHOUT(kData / "mot15");
  TrackerOptions options;
  options.input.calibration = parse_calibration("acf");
  for (const char* name :
       {"ETH-Sunnyday", "KITTI-17", "PETS09-S2L1", "TUD-Campus", "TUD-Stadtmitte"}) {
    const auto folder = kData / "mot15" / name;
    EXPECT_GT(run_tracker(folder, "det.txt", options, eval::Benchmark::mot15).clear.mota,
              run_sort(folder, "det.txt").clear.mota)
        << name;
  }
}

}  // namespace
}  // namespace sdmt::track
