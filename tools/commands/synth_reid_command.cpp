// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <memory>
#include <string>

#include "cli/command.h"
#include "cli/console.h"
#include "cli/progress.h"
#include "cli/stop_signal.h"
#include "synth/synth_reid.h"

namespace sdmt::tools {

namespace {

struct SynthReidCommand {
  std::string output;
  SynthReidOptions reid;

  void run() const {
    reid.validate();
    const StopSignal stop;
    bool whole = false;
    {
      Progress progress("drawing", reid.images(), "images");
      whole = write_synth_reid(output, reid, [&](int images) {
        progress.update(images);
        return !stop.requested();
      });
    }
    if (whole) {
      say(stdout, "{}: {} people, {} images\n", output, reid.identities, reid.images());
    } else {
      say(stdout, "stopped, nothing written\n");
    }
  }
};

}  // namespace

void add_synth_reid_command(CLI::App& synth) {
  auto command = std::make_shared<SynthReidCommand>();
  CLI::App* sub = synth.add_subcommand(
      "reid", "A re-identification set in the layout of Market-1501: made-up people, two cameras");
  sub->add_option("--output", command->output, "New or empty folder to make the set in")
      ->required()
      ->type_name("DIR");
  sub->add_option("--seed", command->reid.seed, "Another seed, other people")
      ->capture_default_str();
  sub->add_option("--identities", command->reid.identities,
                  "People; two thirds are for training, one third for testing")
      ->capture_default_str();
  sub->add_option("--images-per-identity", command->reid.images_per_identity,
                  "Images of each, by the two cameras in turn")
      ->capture_default_str();
  sub->callback([command] { command->run(); });
}

}  // namespace sdmt::tools
