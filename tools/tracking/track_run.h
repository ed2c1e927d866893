// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/core.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "cli/console.h"
#include "cli/detection_arguments.h"
#include "cli/live_arguments.h"
#include "cli/mqtt_arguments.h"
#include "cli/tracker_arguments.h"
#include "mqtt/publisher.h"
#include "sdmt/image/crop_descriptor.h"
#include "sdmt/pipeline/sequence_runner.h"
#include "sdmt/pipeline/zone_writer.h"
#include "serve/camera_view.h"

namespace sdmt::tools {

using Appearances = std::function<std::unique_ptr<image::CropDescriptor>()>;

/// Who follows a run beside its files; nullptr: nobody.
struct Followers {
  CameraView* view = nullptr;      // what --serve and --mqtt tell of it
  Publisher* publisher = nullptr;  // --mqtt
};

/// `sdmt track` as the command line describes it.
struct TrackCommand {
  std::vector<std::string> inputs;
  std::string output_dir;
  std::string serve;
  std::string serve_token;
  bool blur = false;
  bool no_store = false;
  std::string keep;
  std::string input;
  std::string camera;  // its name among several inputs; empty for one alone
  std::string output;
  std::string jsonl;
  std::string render;
  std::string json;
  std::string explain;
  std::string rotate;
  std::string zones;
  pipeline::ZoneFiles zone_files;
  std::string state;
  int state_every = 100;
  bool moving_camera = false;
  bool stats = false;
  DetectionArguments detections;
  LiveArguments live;
  MqttArguments mqtt;
  TrackerArguments tracker;

  // All inputs.
  void run() const;
  // One of several lines of text for whoever watches.
  void warn(const std::string& text) const {
    say(stderr, "sdmt track: {}warning: {}\n", prefix(), text);
  }
  // Whether viewers of --serve get pictures.
  bool shows_pictures() const { return !serve.empty() && !no_store; }
  double keep_seconds() const;
  // Whether boxes come by standard input, and no frames beside them.
  bool boxes_alone() const { return input == "-" && detections.detections == "-"; }
  // The zones for the input's picture. Throws when they do not fit it.
  zones::ZonePlan zone_plan(const pipeline::FrameSource& frames) const;

 private:
  std::string prefix() const { return camera.empty() ? "" : camera + ": "; }
  void run_one(const Appearances& appearances, const std::function<bool()>& stop,
               const Followers& followers) const;
  void run_many(const std::vector<Followers>& followers) const;
  // The same for one of several inputs, with outputs in a folder of its own.
  TrackCommand of_camera(const std::string& one, const std::string& name) const;
  // Throws when no output is wanted.
  void check_wanted() const;
  // Throws when an output cannot be written.
  void check_outputs(const pipeline::DetectionSource& boxes) const;
  // Throws when the sequence has no images and something needs them.
  void check_images(const pipeline::FrameSource& frames, pipeline::DetectionSource& boxes) const;
  // Throws when something would take pictures or vectors out of memory, with --no-store.
  void check_no_store() const;
  // Throws when there is a state to be kept that some output or input cannot go on from.
  void check_state(const pipeline::FrameSource& frames) const;
  std::string run_name() const;
  // Throws when the boxes bring embeddings along that cannot be used as the options say.
  void check_embeddings(pipeline::DetectionSource& boxes) const;
  void report(const pipeline::RunReport& report) const;
};

/// Calls visit(option, file) for every file that the options of a run, a TrackCommand, may name for
/// it to leave.
template <typename Command, typename Visit>
void for_each_output(Command& command, Visit&& visit) {
  visit("--output", command.output);
  visit("--jsonl", command.jsonl);
  visit("--render", command.render);
  visit("--json", command.json);
  visit("--explain", command.explain);
  visit("--state", command.state);
  visit("--events", command.zone_files.events);
  visit("--counts", command.zone_files.counts);
  visit("--heat-map", command.zone_files.heat_map);
}

}  // namespace sdmt::tools
