// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "adaptation/observed_scene.h"
#include "cli/command.h"
#include "cli/console.h"
#include "cli/json_file.h"
#include "cli/named_values.h"
#include "cli/output_paths.h"
#include "cli/progress.h"
#include "cli/run_record.h"
#include "cli/shipped_files.h"
#include "cli/stop_signal.h"
#include "cli/text_table.h"
#include "sdmt/media/image_file.h"
#include "sdmt/pipeline/frame_source.h"
#include "sdmt/reid/market1501.h"
#include "sdmt/reid/model_file.h"
#include "sdmt/train/adaptation.h"
#include "validation/validation.h"

namespace sdmt::tools {

namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct AdaptCommand {
  std::vector<std::string> inputs;
  std::string output;
  SceneView view;
  std::string anchor;
  train::AdaptationOptions learning;
  ValidationOptions threshold;
  reid::Storage storage = reid::Storage::float32;
  std::string json;

  void run();

 private:
  std::vector<ObservedScene> observe_all(const StopSignal& stop) const;
  train::Adaptation learn(reid::Model& model, const train::SceneLessons& lessons,
                          const StopSignal& stop) const;
};

// Of several sequences each has its boxes in a file of that name.
std::string detections_of(const std::string& input, const std::string& detections) {
  if (detections.empty() || detections == "hog" || fs::exists(detections)) return detections;
  const fs::path own = fs::path(input) / "det" / detections;
  return fs::exists(own) ? own.string() : detections;
}

std::vector<image::Image> read_anchors(const fs::path& folder) {
  if (folder.empty()) return {};
  reid::LeftOut left_out;
  std::vector<fs::path> files;
  for (auto& image : reid::list_nameless_images(folder, &left_out)) {
    files.push_back(std::move(image.path));
  }
  media::UnreadableImages unreadable(files.size());
  std::vector<image::Image> images;
  auto decoded = media::read_images(files);
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (decoded[i]) {
      images.push_back(std::move(*decoded[i]));
    } else {
      unreadable.add(files[i]);
      say(stdout, "left out, unreadable: {}\n", files[i].string());
    }
  }
  if (const auto text = left_out.text(); !text.empty()) say(stdout, "left out: {}\n", text);
  return images;
}

std::vector<ObservedScene> AdaptCommand::observe_all(const StopSignal& stop) const {
  std::vector<ObservedScene> scenes;
  for (const std::string& input : inputs) {
    SceneView own = view;
    own.detections.detections = detections_of(input, view.detections.detections);
    if (inputs.size() > 1 && own.detections.detections == view.detections.detections &&
        fs::exists(own.detections.detections)) {
      throw std::invalid_argument("--detections " + own.detections.detections +
                                  ": is one file for several inputs, expected the name of one in "
                                  "the folder det of each");
    }
    std::string doing;
    std::unique_ptr<Progress> progress;
    scenes.push_back(
        observe(input, own, warning_of("adapt"), [&](const char* what, int done, int total) {
          if (stop.requested()) throw Stopped();
          if (doing != what) {
            progress.reset();
            progress = std::make_unique<Progress>(what, std::max(0, total), "frames");
            doing = what;
          }
          progress->update(done);
        }));
    progress.reset();
    const ObservedScene& scene = scenes.back();
    note("{}: {} frames, {} tracks; {} crops of {} tracks teach, {} of {} are held out\n",
         scene.name, scene.frames, scene.tracks, scene.teaching.images.size(),
         scene.teaching.met.tracks(), scene.held_out.images.size(), scene.held_out.met.tracks());
    flush_standard_output();
  }
  return scenes;
}

train::Adaptation AdaptCommand::learn(reid::Model& model, const train::SceneLessons& lessons,
                                      const StopSignal& stop) const {
  Progress progress("adapting", learning.iterations, "steps");
  double auc = 0;
  return train::adapt(model, lessons, learning, [&](const train::AdaptationStep& step) {
    if (stop.requested()) throw Stopped();
    if (step.scored != nullptr) auc = step.scored->auc();
    progress.update(step.iteration,
                    auc > 0 ? fmt::format("loss {:.4f}, held out AUC {:.4f}", step.loss, auc)
                            : fmt::format("loss {:.4f}", step.loss));
  });
}

// What a curve and a threshold are worth, as tables, the model and JSON name it.
struct Measure {
  const char* name;
  double before;
  double after;
};

std::vector<Measure> measures(const train::Adaptation& result, double tau_a_before,
                              double tau_a_after) {
  constexpr double kTpr = train::Adaptation::kTpr;
  const auto before = result.before.at(1 - tau_a_before), after = result.after.at(1 - tau_a_after);
  return {{"auc", result.before.auc(), result.after.auc()},
          {"fmr at tpr 0.7", result.before.fpr_at_tpr(kTpr), result.after.fpr_at_tpr(kTpr)},
          {"tau_a", tau_a_before, tau_a_after},
          {"tpr at tau_a", before.tpr, after.tpr},
          {"fmr at tau_a", before.fpr, after.fpr}};
}

void AdaptCommand::run() {
  learning.validate();
  threshold.validate();
  if (!(view.held_out > 0 && view.held_out < 1)) {
    throw std::invalid_argument(
        fmt::format("--held-out is {}, expected between 0 and 1", view.held_out));
  }
  if (view.tracker.model.empty()) view.tracker.model = find_default_model();
  const fs::path start = view.tracker.model;
  refuse_standard_output({{"--output", output}});
  std::vector<NamedPath> read{{"--model", start}, {"--detections", view.detections.detections}};
  for (const std::string& input : inputs) read.push_back({"INPUT", input});
  check_outputs(read, {{"--output", output}, {"--json", json}});

  reid::Model model = reid::load_model(start);
  const StopSignal stop;
  try {
    train::SceneLessons lessons;
    lessons.anchors = read_anchors(anchor);
    std::vector<std::string> names;
    for (ObservedScene& scene : observe_all(stop)) {
      names.push_back(scene.name);
      lessons.teaching.append(std::move(scene.teaching));
      lessons.held_out.append(std::move(scene.held_out));
    }
    const train::Adaptation result = learn(model, lessons, stop);

    const ThresholdChoice before =
        choose_threshold(result.before, threshold.criterion, threshold.target_fpr);
    const ThresholdChoice after =
        choose_threshold(result.after, threshold.criterion, threshold.target_fpr);
    const auto gains = measures(
        result, model.metadata.tau_a ? model.metadata.tau_a->value : before.tau_a, after.tau_a);
    TextTable table({"held out", "before", "after"});
    ordered_json report;
    report["iterations"] = result.iterations;
    report["gained"] = result.gained();
    reid::AdaptationSummary summary{start.filename().string(), names, date_of_run(),
                                    result.iterations,         {},    {}};
    for (const Measure& gain : gains) {
      table.add_row({gain.name, format_rate(gain.before), format_rate(gain.after)});
      summary.before[gain.name] = report["before"][gain.name] = gain.before;
      summary.after[gain.name] = report["after"][gain.name] = gain.after;
    }
    say(stdout, "{}", table.str());
    write_json_file(json, report);
    if (!result.gained()) {
      throw std::runtime_error(fmt::format(
          "nothing was gained on the part held out (AUC {:.4f}, before {:.4f}; a twentieth of what "
          "is missing to 1 is asked for); {} is not written",
          result.after.auc(), result.before.auc(), output));
    }
    model.metadata.tau_a = reid::AffinityThreshold{after.tau_a, after.criterion, after.fpr};
    model.metadata.adaptation = std::move(summary);
    reid::save_model(output, model, storage);
    note("{} steps of learning; wrote {}, tau_a {:.4f} (by {})\n", result.iterations, output,
         after.tau_a, after.criterion);
  } catch (const Stopped&) {
    say(stdout, "stopped, nothing written\n");
  }
}

void add_learning_options(CLI::App& sub, AdaptCommand& command) {
  train::AdaptationOptions& learning = command.learning;
  const std::string group = "Learning";
  sub.add_option("--iterations", learning.iterations,
                 "Steps at most; it stops early when nothing more is gained")
      ->capture_default_str()
      ->group(group);
  sub.add_option("--lr", learning.learning_rate, "Learning rate of Adam, falls to a tenth")
      ->capture_default_str()
      ->group(group);
  sub.add_option("--anchor", command.anchor,
                 "Folder of crops of any people, on which the network stays as it is [made up from "
                 "the scene's]")
      ->type_name("DIR")
      ->group(group);
  sub.add_option("--anchor-weight", learning.anchor_weight,
                 "How much staying counts against learning")
      ->capture_default_str()
      ->group(group);
  sub.add_option("--seed", learning.seed, "Of everything random")
      ->capture_default_str()
      ->group(group);
  sub.add_option("--held-out", command.view.held_out,
                 "Share of the time, at the end, that does not teach but tells what was gained")
      ->capture_default_str()
      ->group(group);
  sub.add_option("--criterion", command.threshold.criterion,
                 "How tau_a is chosen on the part held out, as by validate-roc")
      ->check(CLI::IsMember({"accuracy", "eer", "crossing", "fpr"}))
      ->capture_default_str()
      ->group(group);
  sub.add_option("--target-fpr", command.threshold.target_fpr, "For --criterion fpr")
      ->capture_default_str()
      ->group(group);
}

}  // namespace

void add_adapt_command(CLI::App& app) {
  auto command = std::make_shared<AdaptCommand>();
  CLI::App* sub = app.add_subcommand(
      "adapt", "Teach a network the people of a scene by the tracks in it, without labels");
  sub->add_option("input", command->inputs,
                  "MOT sequence folder, image folder or video file; several teach together")
      ->required()
      ->expected(1, 64)
      ->type_name("INPUT");
  sub->add_option("--output", command->output, "Model file to write, where something was gained")
      ->required()
      ->type_name("FILE");
  sub->add_option("--storage", command->storage,
                  "Of the weights: float32, float16 or int8 [float32]")
      ->transform(by_name<reid::Storage>({{"float32", reid::Storage::float32},
                                          {"float16", reid::Storage::float16},
                                          {"int8", reid::Storage::int8}}))
      ->type_name("NAME");
  add_frame_range(*sub, command->view.frames, "Only these frames of each input [all]");
  sub->add_option("--json", command->json, "Write the numbers here")->type_name("FILE");
  add_learning_options(*sub, *command);
  add_detection_arguments(*sub, command->view.detections);
  add_tracker_arguments(*sub, command->view.tracker);
  sub->callback([command] { command->run(); });
}

}  // namespace sdmt::tools
