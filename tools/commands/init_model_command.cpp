// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "cli/command.h"
#include "cli/console.h"
#include "cli/output_paths.h"
#include "sdmt/reid/model_file.h"

namespace sdmt::tools {

namespace {

struct InitModelOptions {
  std::string architecture = "vgg16";
  std::string trunk;
  std::uint64_t seed = 0;
  std::string output;
};

void run(const InitModelOptions& options) {
  check_outputs({{"--trunk", options.trunk}}, {{"--output", options.output}});
  reid::Model model =
      reid::untrained_model(reid::find_architecture(options.architecture), options.seed);
  if (options.trunk.empty()) {
    model.metadata.provenance = fmt::format("random weights, seed {}", options.seed);
  } else {
    const auto ignored = reid::load_trunk(options.trunk, model.network);
    const std::string name = std::filesystem::path(options.trunk).filename().string();
    model.metadata.provenance =
        fmt::format("trunk from {}, random head, seed {}", name, options.seed);
    if (!ignored.empty()) {
      say(stdout, "ignored {} tensors of {}: {}\n", ignored.size(), name, fmt::join(ignored, ", "));
    }
  }
  reid::save_model(options.output, model);
  note("wrote {}: {}\n", options.output, model.metadata.provenance);
}

}  // namespace

void add_init_model_command(CLI::App& app) {
  auto options = std::make_shared<InitModelOptions>();
  CLI::App* command = app.add_subcommand(
      "init-model", "Make a model with an untrained head, to train or to measure");
  command
      ->add_option("--architecture", options->architecture,
                   "vgg16 (the paper's), lite, or a file that describes a network")
      ->type_name("NAME|FILE.json")
      ->capture_default_str();
  command
      ->add_option("--trunk", options->trunk,
                   "safetensors file with the trunk's weights under the names of a model file: for "
                   "vgg16 torchvision's, a whole VGG-16 will do [random]")
      ->type_name("FILE");
  command->add_option("--seed", options->seed, "Of the random weights")->capture_default_str();
  command->add_option("--output", options->output, "Model file to write")
      ->required()
      ->type_name("FILE");
  command->callback([options] { run(*options); });
}

}  // namespace sdmt::tools
