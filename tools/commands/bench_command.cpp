// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/command.h"
#include "cli/console.h"
#include "cli/json_file.h"
#include "cli/output_paths.h"
#include "cli/peak_memory.h"
#include "cli/text_table.h"
#include "report/network_summary.h"
#include "sdmt/nn/adam.h"
#include "sdmt/nn/random.h"
#include "sdmt/nn/sequential.h"
#include "sdmt/nn/simd_target.h"
#include "sdmt/reid/model_file.h"

namespace sdmt::tools {

namespace {

using nlohmann::ordered_json;

struct BenchOptions {
  std::string architecture = "vgg16";
  std::string model;
  std::vector<int> batches{1, 8, 40, 128};
  bool train = false;
  int repeat = 10;
  std::string json;
};

struct Timing {
  double median = 0;  // milliseconds
  double min = 0;
};

// Runs the work `repeat` times after once to warm up.
Timing measure(int repeat, const std::function<void()>& work) {
  using Clock = std::chrono::steady_clock;
  work();
  std::vector<double> times;
  for (int i = 0; i < repeat; ++i) {
    const auto start = Clock::now();
    work();
    times.push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
  }
  std::sort(times.begin(), times.end());
  const std::size_t half = times.size() / 2;
  const double median = times.size() % 2 == 1 ? times[half] : (times[half - 1] + times[half]) / 2;
  return {median, times.front()};
}

nn::Tensor random_tensor(nn::Shape shape, std::uint64_t seed) {
  nn::Tensor tensor(shape);
  nn::Random random(seed);
  for (float& value : tensor.values()) value = static_cast<float>(random.uniform(-2, 2));
  return tensor;
}

Timing measure_forward(reid::EmbeddingNetwork& network, int batch, int repeat) {
  const nn::Tensor patches = random_tensor(network.input_shape(batch), 1);
  return measure(repeat, [&] { network.forward(patches, nn::Mode::inference); });
}

// One step: forward, backward and update; the loss itself costs nothing beside them. A frozen trunk
// runs forward only.
Timing measure_training(reid::EmbeddingNetwork& network, int batch, bool frozen, int repeat) {
  for (const auto& named : network.trunk().named_parameters()) {
    named.parameter->trainable = !frozen;
  }
  auto parameters = network.head().named_parameters();
  if (!frozen) {
    const auto trunk = network.trunk().named_parameters();
    parameters.insert(parameters.begin(), trunk.begin(), trunk.end());
  }
  nn::Adam optimizer(parameters, {.learning_rate = 1e-6});
  const nn::Tensor patches = random_tensor(network.input_shape(batch), 1);
  const nn::Tensor gradient = random_tensor({batch, 1, 1, network.embedding_size()}, 2);
  nn::Tensor feature_gradient;
  return measure(repeat, [&] {
    optimizer.zero_grad();
    const nn::Mode trunk_mode = frozen ? nn::Mode::inference : nn::Mode::training;
    network.head().forward(network.trunk().forward(patches, trunk_mode), nn::Mode::training);
    network.head().backward(gradient, frozen ? nullptr : &feature_gradient);
    if (!frozen) network.trunk().backward(feature_gradient);
    optimizer.step();
    network.parameters_changed();
  });
}

void run(const BenchOptions& options) {
  check_outputs({{"--model", options.model}}, {{"--json", options.json}});
  reid::Model model = options.model.empty()
                          ? reid::untrained_model(reid::find_architecture(options.architecture), 0)
                          : reid::load_model(options.model);
  reid::EmbeddingNetwork& network = model.network;
  ordered_json result;
  result["threads"] = omp_get_max_threads();
  result["target"] = nn::simd_target();
  say(stdout, "{} threads, {}\n", omp_get_max_threads(), nn::simd_target());

  TextTable forward({"forward", "ms median", "ms min", "ms a patch", "GFLOP/s"});
  result["forward"] = ordered_json::array();
  for (const int batch : options.batches) {
    const Timing timing = measure_forward(network, batch, options.repeat);
    const double gflops = batch * total_gflop(network) / timing.median * 1e3;
    forward.add_row({fmt::format("batch {}", batch), fmt::format("{:.2f}", timing.median),
                     fmt::format("{:.2f}", timing.min),
                     fmt::format("{:.2f}", timing.median / batch), fmt::format("{:.0f}", gflops)});
    result["forward"].push_back({{"batch", batch},
                                 {"ms_median", timing.median},
                                 {"ms_min", timing.min},
                                 {"gflops", gflops}});
  }
  say(stdout, "{}", forward.str());

  if (options.train) {
    TextTable train({"training step", "ms median", "ms min"});
    result["train"] = ordered_json::array();
    for (const int batch : options.batches) {
      if (batch == 1) continue;  // batch normalisation needs two
      for (const bool frozen : {false, true}) {
        const Timing timing = measure_training(network, batch, frozen, options.repeat);
        train.add_row({fmt::format("batch {}, {}", batch, frozen ? "trunk frozen" : "all layers"),
                       fmt::format("{:.1f}", timing.median), fmt::format("{:.1f}", timing.min)});
        result["train"].push_back({{"batch", batch},
                                   {"frozen", frozen},
                                   {"ms_median", timing.median},
                                   {"ms_min", timing.min}});
      }
    }
    say(stdout, "\n{}", train.str());
  }
  result["peak_rss_mib"] = peak_rss_mib();
  say(stdout,
      "\npeak memory {:.0f} MiB; GFLOP/s count every convolution directly, {:.2f} GFLOP a patch\n",
      peak_rss_mib(), total_gflop(network));
  write_json_file(options.json, result);
}

}  // namespace

void add_bench_command(CLI::App& app) {
  auto options = std::make_shared<BenchOptions>();
  CLI::App* command = app.add_subcommand("bench", "Measure the network on this machine");
  auto* architecture = command
                           ->add_option("--architecture", options->architecture,
                                        "vgg16 (the paper's), lite, or a file that describes a "
                                        "network; random weights, so fc1 stays float32")
                           ->type_name("NAME|FILE.json")
                           ->capture_default_str();
  command->add_option("--model", options->model, "Model file in its place")
      ->type_name("FILE")
      ->excludes(architecture);
  command->add_option("--batch", options->batches, "Patches at once, a list")
      ->delimiter(',')
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  command->add_flag("--train", options->train, "Also measure training steps, batches above 1");
  command->add_option("--repeat", options->repeat, "Runs of each kind, after one to warm up")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command->add_option("--json", options->json, "Write the figures here")->type_name("FILE");
  command->callback([options] { run(*options); });
}

}  // namespace sdmt::tools
