// SPDX-License-Identifier: Apache-2.0
#include "cli/tracker_arguments.h"

#include <fmt/core.h>
#include <omp.h>

#include <filesystem>
#include <set>
#include <string_view>
#include <utility>

#include "cli/shipped_files.h"
#include "cli/table_option.h"
#include "sdmt/image/color_histogram.h"
#include "sdmt/reid/embedder.h"
#include "sdmt/reid/shared_embedder.h"
#include "sdmt/track/tracker_option_table.h"

namespace sdmt::tools {

namespace {

// The options that most users ever need; the help lists the others in a group of their own.
const std::set<std::string_view> kFrequent{"lambda", "boosting", "association", "delay",
                                           "embed",  "tau-a",    "calibration", "min-confidence"};

}  // namespace

void add_tracker_arguments(CLI::App& command, TrackerArguments& arguments) {
  command.add_option("--model", arguments.model, "Embedding network [the shipped one]")
      ->type_name("FILE");
  command
      .add_option("--appearance", arguments.appearance,
                  "What tells people apart: network, histogram (of colours) or none")
      ->check(CLI::IsMember({"network", "histogram", "none"}).description(""))
      ->type_name("")
      ->capture_default_str();
  command.add_flag("--no-appearance", arguments.no_appearance,
                   "Motion alone, as --appearance none; frames are then not needed");
  for (const auto& entry : track::tracker_option_table()) {
    add_table_option(command, arguments.options, entry)
        ->group(kFrequent.contains(entry.name) ? "Tracker" : "Tracker in detail: " + entry.group);
  }
}

std::unique_ptr<image::CropDescriptor> TrackerArguments::load_appearance(
    const Warning& warning) const {
  if (!uses_appearance()) return nullptr;
  if (appearance == "histogram") return std::make_unique<image::ColorHistogramDescriptor>();
  const bool needs_threshold = !options.appearance.tau_a;
  return load_network_appearance(
      model, needs_threshold ? warning : [](const std::string&) {});
}

std::function<std::unique_ptr<image::CropDescriptor>()> TrackerArguments::load_appearances(
    const Warning& warning) const {
  const auto first = load_appearance(warning);
  const auto* network = dynamic_cast<const reid::Embedder*>(first.get());
  if (network == nullptr) return [*this, warning] { return load_appearance(warning); };
  const auto shared =
      std::make_shared<reid::SharedEmbedder>(network->model(), omp_get_max_threads());
  return [shared] { return shared->client(); };
}

std::unique_ptr<image::CropDescriptor> load_network_appearance(const std::string& file,
                                                               const Warning& warning) {
  const auto path = file.empty() ? find_default_model() : std::filesystem::path(file);
  reid::Model model = reid::load_model(path);
  if (!model.metadata.tau_a) {
    warning(
        fmt::format("{}: holds no tau_a, {} is taken; a threshold fits one network only: "
                    "measure it with sdmt validate-roc --write-threshold",
                    path.string(), reid::AffinityThreshold{}.value));
    model.metadata.tau_a = reid::AffinityThreshold{};
  }
  return std::make_unique<reid::Embedder>(std::move(model));
}

}  // namespace sdmt::tools
