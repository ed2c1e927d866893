// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "cli/command.h"
#include "cli/console.h"
#include "cli/output_paths.h"
#include "report/zone_counts_text.h"
#include "sdmt/io/output_file.h"
#include "sdmt/mot/mot_file.h"
#include "sdmt/mot/sequence.h"
#include "sdmt/zones/counts_table.h"
#include "sdmt/zones/event_lines.h"

namespace sdmt::tools {

namespace {

struct CountCommand {
  std::string results;
  std::string zones;
  std::string truth;
  double frame_rate = 0;
  std::string events;
  std::string counts;

  void run() const;
};

using Frames = std::map<int, track::FinishedFrame>;

void add(int frame, int id, const mot::Tlwh& box, Frames& frames) {
  frames[frame].frame = frame;
  frames[frame].boxes.push_back({.id = id, .box = box});
}

Frames of_results(const std::string& file) {
  Frames frames;
  for (const mot::ResultRow& row : mot::read_results(file)) add(row.frame, row.id, row.box, frames);
  return frames;
}

// People, not what else the ground truth of MOT16 and later marks.
Frames of_truth(const std::filesystem::path& file) {
  Frames frames;
  for (const mot::GroundTruthRow& row : mot::read_ground_truth(file)) {
    if (row.keep && row.category <= 1) add(row.frame, row.id, row.box, frames);
  }
  return frames;
}

zones::ZoneCounter count(const Frames& frames, const zones::ZonePlan& plan, double frame_rate,
                         std::string& event_lines) {
  zones::ZoneCounter counter(plan);
  const auto tell = [&](const std::vector<zones::ZoneEvent>& events) {
    for (const zones::ZoneEvent& event : events) event_lines += zones::event_line(event);
  };
  for (const auto& [number, frame] : frames) tell(counter.add(frame, (number - 1) / frame_rate));
  tell(counter.finish());
  return counter;
}

void CountCommand::run() const {
  check_outputs({{"RESULTS", results}, {"--zones", zones}, {"--gt", truth}},
                {{"--events", events}, {"--counts", counts}});
  zones::ZonePlan plan = zones::read_zone_plan(zones);
  double rate = frame_rate;
  std::filesystem::path truth_file = truth;
  if (!truth.empty() && mot::Sequence::is_sequence(truth)) {
    const auto sequence = mot::Sequence::read(truth);
    truth_file = sequence.ground_truth();
    if (rate == 0) rate = sequence.frame_rate;
    if (sequence.width > 0) plan = plan.in_picture(sequence.width, sequence.height);
  }
  if (rate == 0) {
    throw std::invalid_argument(
        "how many frames a second the results have is not known: give --frame-rate, or --gt with a "
        "sequence folder");
  }
  std::string lines, truth_lines;
  const zones::ZoneCounter counter = count(of_results(results), plan, rate, lines);
  if (truth.empty()) {
    say(stdout, "{}", zone_counts_text(counter));
  } else {
    say(stdout, "{}",
        zone_counts_text(counter, count(of_truth(truth_file), plan, rate, truth_lines)));
  }
  if (!events.empty()) io::write_text_file(events, lines);
  if (!counts.empty()) io::write_text_file(counts, zones::counts_table(counter));
}

}  // namespace

void add_count_command(CLI::App& app) {
  auto command = std::make_shared<CountCommand>();
  CLI::App* sub = app.add_subcommand("count", "Count people who cross lines and stay in areas");
  sub->add_option("results", command->results, "Tracks as MOTChallenge result rows")
      ->required()
      ->type_name("RESULTS");
  sub->add_option("--zones", command->zones, "Lines and areas, JSON")
      ->required()
      ->type_name("FILE");
  sub->add_option("--gt", command->truth,
                  "Count the ground truth beside: a MOT sequence folder, or a gt.txt")
      ->type_name("SEQUENCE");
  sub->add_option("--frame-rate", command->frame_rate,
                  "Frames per second [that of the sequence of --gt]")
      ->check(CLI::Range(0.1, 5000.0));
  sub->add_option("--events", command->events, "What happened, a JSON object a line")
      ->type_name("FILE");
  sub->add_option("--counts", command->counts, "Counts in all and by the hour, CSV")
      ->type_name("FILE");
  sub->callback([command] { command->run(); });
}

}  // namespace sdmt::tools
