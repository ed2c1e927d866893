// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "cli/command.h"
#include "cli/console.h"
#include "cli/detection_arguments.h"
#include "cli/output_paths.h"
#include "cli/progress.h"
#include "cli/stop_signal.h"
#include "cli/text_table.h"
#include "sdmt/eval/detection_scores.h"
#include "sdmt/eval/ground_truth.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/io/output_file.h"
#include "sdmt/mot/sequence.h"
#include "sdmt/pipeline/frame_source.h"
#include "sdmt/track/tracker.h"

namespace sdmt::tools {

namespace fs = std::filesystem;

namespace {

struct DetectCommand {
  std::string input;
  std::string output;
  DetectionArguments detection;
  std::vector<std::string> compare;
  int every = 1;
  double least_score = 0.3;

  void run() const;

 private:
  void keep() const;
  void compare_all() const;
};

// Calls visit(frame) for every `every`-th frame, counted from the first, until told to stop.
template <typename Visit>
void for_each_frame(const std::string& input, int every, const std::string& label, Visit&& visit) {
  const StopSignal stop;
  const auto frames = pipeline::open_frame_source(input);
  if (!frames->has_images()) throw std::invalid_argument(input + ": the sequence has no frames");
  Progress progress(label, frames->frame_count(), "frames");
  // As wanted, or not decoded at all.
  int number = 0;
  for (pipeline::Frame frame; !stop.requested() && frames->next(frame, number % every == 0);
       ++number) {
    if (number % every != 0) continue;
    if (!frame.problem.empty()) warning_of("detect")(frame.problem);
    visit(frame);
    progress.update(frame.number);
  }
}

std::string json_line(int frame, const std::vector<mot::Detection>& boxes) {
  std::string places, scores;
  for (const auto& [box, score] : boxes) {
    const char* comma = places.empty() ? "" : ",";
    places += fmt::format("{}[{:.2f},{:.2f},{:.2f},{:.2f}]", comma, box.left, box.top, box.width,
                          box.height);
    scores += fmt::format("{}{:.6g}", comma, score);
  }
  return fmt::format("{{\"frame\":{},\"boxes\":[{}],\"scores\":[{}]}}\n", frame, places, scores);
}

std::string mot_rows(int frame, const std::vector<mot::Detection>& boxes) {
  std::string rows;
  for (const auto& [box, score] : boxes) rows += mot::format_result({frame, -1, box, score, -1});
  return rows;
}

void DetectCommand::keep() const {
  const bool lines = fs::path(output).extension() == ".jsonl";
  const auto detector = pipeline::open_detector(
      detection.detector.empty() ? "hog" : detection.detector, detection.options);
  check_outputs({{"INPUT", input}, {"--detector", detection.detector}}, {{"--output", output}});
  io::OutputFile file(output);
  int frames = 0;
  std::size_t boxes = 0;
  // A detector that fails keeps what it found before.
  const auto detect = [&](const pipeline::Frame& frame) {
    try {
      return detector->detect(frame);
    } catch (const std::runtime_error&) {
      file.commit();
      throw;
    }
  };
  for_each_frame(input, every, "detecting", [&](const pipeline::Frame& frame) {
    const auto found = detect(frame);
    ++frames;
    boxes += found.size();
    file.write(lines ? json_line(frame.number, found) : mot_rows(frame.number, found));
  });
  file.commit();
  note("{} frames, {} boxes\n", frames, boxes);
}

// The boxes of one frame, by frame number.
struct Truth {
  std::vector<mot::Tlwh> people, ignored;
};

std::optional<std::vector<Truth>> read_truth(const std::string& input) {
  if (!mot::Sequence::is_sequence(input)) return std::nullopt;
  if (!fs::exists(mot::Sequence::read(input).ground_truth())) return std::nullopt;
  std::vector<Truth> frames;
  constexpr int kMostFrames = 10'000'000, kPedestrian = 1;
  for (const auto& row : eval::read_sequence_ground_truth(input).rows) {
    if (row.frame > kMostFrames) continue;
    if (row.frame >= static_cast<int>(frames.size())) frames.resize(row.frame + 1);
    const bool person = row.keep && row.category <= kPedestrian;
    (person ? frames[row.frame].people : frames[row.frame].ignored).push_back(row.box);
  }
  return frames;
}

bool holds_boxes(const fs::path& path) {
  constexpr std::array<std::string_view, 4> kEndings{".txt", ".csv", ".json", ".jsonl"};
  return fs::is_directory(path) ||
         std::find(kEndings.begin(), kEndings.end(), path.extension()) != kEndings.end();
}

// A detector as --detector names it, FILE@SIZE: a network at another size of its input, or boxes
// that somebody else found in `input`.
std::unique_ptr<pipeline::DetectionSource> open_contender(const std::string& name,
                                                          const std::string& input,
                                                          DetectionArguments arguments) {
  if (holds_boxes(name)) {
    arguments.detections = name;
    return arguments.open(input);
  }
  pipeline::DetectorOptions& options = arguments.options;
  const auto at = name.rfind('@');
  if (at == std::string::npos || fs::exists(name)) return pipeline::open_detector(name, options);
  const auto size = io::parse_number<int>(std::string_view(name).substr(at + 1));
  if (!size) {
    throw std::invalid_argument("--compare " + io::quoted(name) +
                                ": expected pixels after the @, as in detector.onnx@512");
  }
  options.network.size = *size;
  return pipeline::open_detector(name.substr(0, at), options);
}

void DetectCommand::compare_all() const {
  struct Contender {
    std::string name;
    std::unique_ptr<pipeline::DetectionSource> detector;
    eval::DetectionScorer scorer;
    track::Tracker tracker;  // by motion alone
    std::size_t boxes = 0, tracked = 0;
    double seconds = 0;
    int frames = 0;
    void count(const std::vector<track::FinishedFrame>& finished) {
      for (const auto& frame : finished) {
        for (const auto& box : frame.boxes) {
          tracked += box.source == track::BoxSource::detected ? 1 : 0;
        }
      }
    }
  };
  std::vector<Contender> contenders;
  for (const std::string& name : compare) {
    contenders.push_back({.name = name,
                          .detector = open_contender(name, input, detection),
                          .scorer = {},
                          .tracker = track::Tracker()});
  }
  const auto truth = read_truth(input);
  for_each_frame(input, every, "comparing", [&](const pipeline::Frame& frame) {
    for (Contender& contender : contenders) {
      const auto start = std::chrono::steady_clock::now();
      const auto boxes = contender.detector->detect(frame);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      contender.seconds += took.count();
      ++contender.frames;
      for (const auto& box : boxes) contender.boxes += box.score >= least_score ? 1 : 0;
      if (!truth) {
        contender.count(contender.tracker.update(boxes));
        continue;
      }
      const bool known = frame.number < static_cast<int>(truth->size());
      const Truth& there = known ? (*truth)[frame.number] : Truth();
      contender.scorer.add_frame(there.people, there.ignored, boxes);
    }
  });
  TextTable table(truth ? std::vector<std::string>{"detector", "people", "boxes", "recall",
                                                   "precision", "AP", "ms/frame"}
                        : std::vector<std::string>{"detector", "boxes", "in tracks", "ms/frame"});
  for (Contender& contender : contenders) {
    const bool looked = contender.detector->needs_images();
    const auto ms =
        looked ? fmt::format("{:.1f}", 1000 * contender.seconds / std::max(1, contender.frames))
               : "-";
    const auto name =
        contender.name == "hog" ? "hog" : fs::path(contender.name).filename().string();
    if (truth) {
      const auto scores = contender.scorer.scores(least_score);
      table.add_row({name, std::to_string(scores.people), std::to_string(scores.boxes),
                     fmt::format("{:.3f}", scores.recall), fmt::format("{:.3f}", scores.precision),
                     fmt::format("{:.3f}", scores.average_precision), ms});
    } else {
      contender.count(contender.tracker.finish());
      const double all = std::max<double>(1, static_cast<double>(contender.boxes));
      table.add_row({name, std::to_string(contender.boxes),
                     fmt::format("{:.3f}", static_cast<double>(contender.tracked) / all), ms});
    }
  }
  const int frames = contenders.front().frames;
  say(stdout, "{} frames, boxes with a score of {:.2g} or more{}\n{}", frames, least_score,
      truth ? ", IoU 0.5" : ", without ground truth", table.str());
}

void DetectCommand::run() const {
  if (compare.empty() == output.empty()) {
    throw std::invalid_argument("expected either --output FILE or --compare DETECTOR...");
  }
  if (!compare.empty() && !detection.detector.empty()) {
    throw std::invalid_argument("--compare names its detectors itself; leave --detector out");
  }
  output.empty() ? compare_all() : keep();
}

}  // namespace

void add_detect_command(CLI::App& app) {
  auto command = std::make_shared<DetectCommand>();
  CLI::App* sub = app.add_subcommand("detect", "Find people with a detector, or compare detectors");
  sub->add_option("input", command->input,
                  "MOT sequence folder, image folder, video file, camera:N or rtsp:// URL")
      ->required()
      ->type_name("INPUT");
  sub->add_option(
         "--output", command->output,
         "Boxes as MOT rows, or as JSON lines where the name ends in .jsonl; - for rows on "
         "standard output")
      ->type_name("FILE");
  sub->add_option(
         "--compare", command->compare,
         "Detectors, as for --detector, FILE@SIZE for another --detector-size, or boxes (.txt, "
         ".csv, .json, .jsonl or a folder): recall, precision, average precision against the "
         "sequence's ground truth, and ms a frame; without ground truth the share of boxes "
         "that become tracks")
      ->type_name("FILE|hog");
  sub->add_option("--every", command->every, "Only every so many frames")
      ->check(CLI::Range(1, 1000000).description(""))
      ->capture_default_str()
      ->type_name("N");
  sub->add_option("--score", command->least_score, "Least score of a box that --compare counts")
      ->capture_default_str();
  add_detector_arguments(*sub, command->detection);
  sub->callback([command] { command->run(); });
}

}  // namespace sdmt::tools
