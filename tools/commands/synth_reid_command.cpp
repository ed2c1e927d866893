// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <memory>
#include <string>

#include "cli/command.h"
#include "synth/drawing_run.h"
#include "synth/reid_set_writer.h"

namespace sdmt::tools {

namespace {

struct SynthReidCommand {
  std::string output;
  ReidSetOptions reid;

  void run() const {
    reid.validate();
    run_drawing(
        reid.images(), "images",
        fmt::format("{}: {} people, {} images", output, reid.identities, reid.images()),
        [&](const DrawingProgress& progress) { return write_reid_set(output, reid, progress); });
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
