// SPDX-License-Identifier: Apache-2.0
// sdmt.tune: in a module of its own, because it needs OpenCV.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "option_texts.h"
#include "sdmt/io/output_file.h"
#include "sdmt/reid/embedder.h"
#include "sdmt/track/tracker_option_table.h"
#include "sdmt/tuning/detection_embeddings.h"
#include "sdmt/tuning/tuning_json.h"
#include "sdmt/tuning/tuning_run.h"
#include "signals.h"

namespace {

using namespace sdmt;
namespace py = pybind11;

// The result and the preset as JSON. Runs without the interpreter's lock, which those threads take
// that call `progress`.
std::pair<std::string, std::string> tune(const tuning::TuningOptions& options,
                                         const track::TrackerOptions& base,
                                         const std::string& model, const std::string& output,
                                         const std::string& state, const py::object& progress) {
  if (!output.empty()) const io::OutputFile writable(output);  // before the work
  tuning::TuningPlan plan = tuning::make_plan(options, base);
  if (!model.empty()) {
    reid::Embedder embedder(reid::load_model(model));
    tuning::embed_detections(plan, embedder, [](int) { python::look_for_signals(); });
  }
  const auto report = [&](std::int64_t done) {
    if (progress.is_none()) return;
    const py::gil_scoped_acquire held;
    progress(done, plan.runs());
  };
  const auto never_but_for_signals = [] {
    python::look_for_signals();
    return false;
  };
  const auto grid = tuning::run_tuning(plan, state, report, never_but_for_signals);
  const auto result = tuning::tuning_result(plan, grid.value());
  std::string preset = tuning::preset_json(result.chosen);
  if (!output.empty()) io::write_text_file(output, preset);
  return {tuning::tuning_json(result), std::move(preset)};
}

}  // namespace

PYBIND11_MODULE(_tuning, module) {
  module.def("tune", [](const std::vector<std::string>& sequences,
                        const std::vector<std::pair<std::string, std::vector<std::string>>>& tuned,
                        const python::OptionTexts& base, const std::string& model, int settings,
                        int draws, double drop, std::uint64_t seed, const std::string& output,
                        const std::string& state, const py::object& progress) {
    tuning::TuningOptions options;
    options.sequences = sequences;
    for (const auto& [name, values] : tuned) options.tuned.push_back({name, values});
    options.settings = settings;
    options.draws = draws;
    options.drop = drop;
    options.seed = seed;
    const auto tracker = python::to_options(base, track::tracker_option_table(), "tracker");
    const py::gil_scoped_release free;
    return tune(options, tracker, model, output, state, progress);
  });
}
