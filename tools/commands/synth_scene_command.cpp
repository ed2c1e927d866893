// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <memory>
#include <string>

#include "cli/command.h"
#include "synth/drawing_run.h"
#include "synth/scene_writer.h"

namespace sdmt::tools {

namespace {

struct SynthSceneCommand {
  std::string output;
  SceneOptions scene;

  void run() const {
    run_drawing(
        scene.frames, "frames",
        fmt::format("{}: {} frames of {} x {}, {} walkers at a time", output, scene.frames,
                    scene.width, scene.height, scene.walkers),
        [&](const DrawingProgress& progress) { return write_scene(output, scene, progress); });
  }
};

}  // namespace

void add_synth_scene_command(CLI::App& synth) {
  auto command = std::make_shared<SynthSceneCommand>();
  CLI::App* sub = synth.add_subcommand(
      "scene", "A MOT sequence: frames with walkers, ground truth and noisy detections");
  sub->add_option("--output", command->output, "New or empty folder to make the sequence in")
      ->required()
      ->type_name("DIR");
  sub->add_option("--seed", command->scene.seed, "Another seed, another scene")
      ->capture_default_str();
  sub->add_option("--frames", command->scene.frames, "Length")->capture_default_str();
  sub->add_option("--walkers", command->scene.walkers, "People at a time")->capture_default_str();
  sub->add_option("--width", command->scene.width, "Pixels")->capture_default_str();
  sub->add_option("--height", command->scene.height, "Pixels")->capture_default_str();
  sub->add_option("--frame-rate", command->scene.frame_rate, "Frames per second")
      ->capture_default_str();
  sub->add_flag("--uniform", command->scene.uniform, "Everybody is dressed alike");
  sub->callback([command] { command->run(); });
}

}  // namespace sdmt::tools
