// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/command.h"
#include "cli/console.h"
#include "cli/json_file.h"
#include "cli/output_paths.h"
#include "cli/text_table.h"
#include "report/network_summary.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/reid/model_file.h"

namespace sdmt::tools {

namespace {

using nlohmann::ordered_json;

struct InspectOptions {
  std::string file;
  std::string json;
};

// Every file is one of these; a checkpoint is a model and more.
std::string kind_of(const io::Safetensors& file) {
  if (!file.metadata().contains(reid::kModelMetadataKey)) return "tensors";
  return file.find("training.progress") != nullptr ? "checkpoint" : "model";
}

ordered_json describe(const io::Safetensors& file, reid::Model* model) {
  ordered_json result;
  result["file"] = file.name();
  result["kind"] = kind_of(file);
  result["bytes"] = std::filesystem::file_size(file.name());
  if (model != nullptr) {
    result["model"] = ordered_json::parse(reid::to_json(model->metadata));
    auto& layers = result["layers"] = ordered_json::array();
    for (const LayerSummary& layer : summarize(model->network)) {
      layers.push_back({{"name", layer.name},
                        {"type", layer.type},
                        {"output", {layer.output.h, layer.output.w, layer.output.c}},
                        {"parameters", layer.parameters},
                        {"gflop", layer.gflop}});
    }
  }
  for (const auto& [key, text] : file.metadata()) {
    if (key != reid::kModelMetadataKey) result["metadata"][key] = text;
  }
  auto& tensors = result["tensors"] = ordered_json::array();
  for (const io::SafetensorsEntry& entry : file.tensors()) {
    tensors.push_back({{"name", entry.name},
                       {"dtype", entry.dtype_text},
                       {"shape", entry.shape},
                       {"bytes", entry.size}});
  }
  return result;
}

void print_model(reid::Model& model) {
  const reid::ModelMetadata& metadata = model.metadata;
  const image::Preprocessing& p = metadata.preprocessing;
  say(stdout, "architecture   {} (format {})\n", metadata.architecture, metadata.format_version);
  say(stdout, "input          {} x {} (height x width), {}, mean {}, std {}\n", p.height, p.width,
      p.order == image::ChannelOrder::rgb ? "rgb" : "bgr", fmt::join(p.mean, " "),
      fmt::join(p.std, " "));
  say(stdout, "flatten order  {}\n", metadata.flatten_order);
  say(stdout, "margin         {}\n", metadata.margin);
  if (metadata.tau_a) {
    const auto& tau_a = *metadata.tau_a;
    say(stdout, "tau_a          {} (by {}{})\n", tau_a.value, tau_a.criterion,
        tau_a.false_positive_rate
            ? fmt::format(", false positive rate {:.4g}", *tau_a.false_positive_rate)
            : "");
  } else {
    say(stdout, "tau_a          not set (sdmt validate-roc --write-threshold)\n");
  }
  if (metadata.training) {
    say(stdout, "training       {} iterations, {}, on {}\n", metadata.training->iterations,
        metadata.training->loss, fmt::join(metadata.training->datasets, ", "));
    for (const auto& [name, score] : metadata.training->scores) {
      say(stdout, "               {} {:.4f}\n", name, score);
    }
  } else {
    say(stdout, "training       none\n");
  }
  if (metadata.adaptation) {
    const auto& adaptation = *metadata.adaptation;
    say(stdout, "adapted        from {} to {}, {}, {} iterations\n", adaptation.start,
        fmt::join(adaptation.scenes, ", "), adaptation.date, adaptation.iterations);
    for (const auto& [name, score] : adaptation.before) {
      const auto after = adaptation.after.find(name);
      if (after == adaptation.after.end()) continue;
      say(stdout, "               {} {:.4f}, before {:.4f}\n", name, after->second, score);
    }
  }
  say(stdout, "provenance     {}\n\n",
      metadata.provenance.empty() ? "unknown" : metadata.provenance);

  TextTable table({"layer", "type", "output h x w x c", "parameters", "GFLOP"}, {1});
  std::int64_t parameters = 0;
  for (const LayerSummary& layer : summarize(model.network)) {
    parameters += layer.parameters;
    table.add_row({layer.name, layer.type,
                   fmt::format("{} x {} x {}", layer.output.h, layer.output.w, layer.output.c),
                   layer.parameters == 0 ? "" : fmt::format("{}", layer.parameters),
                   layer.gflop == 0 ? "" : fmt::format("{:.3f}", layer.gflop)});
  }
  table.add_rule();
  table.add_row({"total", "", "", fmt::format("{}", parameters),
                 fmt::format("{:.3f}", total_gflop(model.network))});
  say(stdout, "{}\n", table.str());
}

void run(const InspectOptions& options) {
  check_outputs({{"FILE", options.file}}, {{"--json", options.json}});
  const io::Safetensors file(options.file);
  std::optional<reid::Model> model;
  // Reading the model checks that it would work, not only that it can be listed.
  if (kind_of(file) != "tensors") model = reid::read_model(file);

  say(stdout, "{}: {}, {:.1f} MB\n", options.file, kind_of(file),
      static_cast<double>(std::filesystem::file_size(options.file)) / 1e6);
  if (model) print_model(*model);
  for (const auto& [key, text] : file.metadata()) {
    if (key != reid::kModelMetadataKey) say(stdout, "{}: {}\n", key, text);
  }
  if (kind_of(file) == "checkpoint") {
    say(stdout, "training.progress: iteration {}\n", file.read_integers("training.progress").at(0));
  }
  TextTable table({"tensor", "dtype", "shape", "bytes"}, {1, 2});
  for (const io::SafetensorsEntry& entry : file.tensors()) {
    table.add_row({io::printable(entry.name), io::printable(entry.dtype_text), entry.shape_str(),
                   fmt::format("{}", entry.size)});
  }
  say(stdout, "{}", table.str());
  write_json_file(options.json, describe(file, model ? &*model : nullptr));
}

}  // namespace

void add_inspect_command(CLI::App& app) {
  auto options = std::make_shared<InspectOptions>();
  CLI::App* command = app.add_subcommand(
      "inspect", "Show what a model, a checkpoint or any other safetensors file holds");
  command->add_option("FILE", options->file, "safetensors file")->required();
  command->add_option("--json", options->json, "Write the same as JSON here")->type_name("FILE");
  command->callback([options] { run(*options); });
}

}  // namespace sdmt::tools
