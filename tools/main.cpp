// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>
#include <omp.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "command.h"
#include "config_arguments.h"
#include "stop_signal.h"

namespace {

using namespace sdmt::tools;

constexpr int kFailure = 1;
constexpr int kBadInput = 2;

void add_commands(CLI::App& app) {
  add_ablate_command(app);
  add_evaluate_command(app);
  add_embed_command(app);
  add_init_model_command(app);
  add_inspect_command(app);
  add_bench_command(app);
  add_train_embedder_command(app);
  add_track_command(app);
  add_validate_roc_command(app);
  CLI::App* synth = app.add_subcommand("synth", "Make practice data");
  synth->require_subcommand(1);
  add_synth_scene_command(*synth);
  add_synth_reid_command(*synth);
}

// Every command that does work gets --config and --threads.
void add_shared_options(CLI::App& app) {
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  for (CLI::App* command : commands) add_shared_options(*command);
  if (!commands.empty() || app.get_parent() == nullptr) return;
  app.add_option_function<std::vector<std::string>>(
         "--config", [](const std::vector<std::string>&) {},
         "JSON file of options, or the name of a shipped one (track-paper, ...); may be repeated, "
         "the later wins, options typed here win over all")
      ->allow_extra_args(false)
      ->type_name("FILE");
  app.add_option_function<int>(
         "--threads", [](int threads) { omp_set_num_threads(threads); },
         "Threads to use [all cores]; the results do not depend on it")
      ->check(CLI::Range(1, 1024));
}

// The libraries under us shall neither print nor start threads of their own.
void quiet_opencv() {
  cv::setNumThreads(1);
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
}

// A parse error, with the config file that the offending value came from, on one line.
std::string parse_message(const CLI::ParseError& error, const ExpandedArguments& expanded) {
  std::string message = error.what();
  for (const auto& [option, file] : expanded.origin) {
    const auto at = message.find(option);
    if (at == std::string::npos) continue;
    const auto end = at + option.size();
    if (end < message.size() &&
        (std::isalnum(static_cast<unsigned char>(message[end])) != 0 || message[end] == '-')) {
      continue;  // a longer name
    }
    message += fmt::format(" (set in {})", file);
  }
  std::replace(message.begin(), message.end(), '\n', ' ');
  return message;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Deep similarity metric learning for real-time pedestrian tracking"};
  app.name("sdmt");
  app.set_version_flag("--version", std::string("sdmt ") + SDMT_VERSION);
  app.require_subcommand(1);
  add_commands(app);
  add_shared_options(app);
  quiet_opencv();

  const std::vector<std::string> typed(argv + 1, argv + argc);
  const auto report = [&](const std::string& message, int code) {
    fmt::print(stderr, "{}: {}\n", command_name(app, typed), message);
    return code;
  };
  const bool unknown =
      !typed.empty() && !typed[0].starts_with('-') && command_name(app, typed) == app.get_name();
  if (typed.empty() || unknown) {
    const std::string wrong = unknown ? fmt::format("unknown command '{}'; ", typed[0]) : "";
    return report(wrong + "sdmt --help lists the commands", kBadInput);
  }
  ExpandedArguments expanded;
  try {
    expanded = expand_config(app, typed);
    app.parse(std::vector<std::string>(expanded.arguments.rbegin(),  // CLI11 wants the last first
                                       expanded.arguments.rend()));
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return report(parse_message(error, expanded), kBadInput);
  } catch (const std::logic_error& error) {
    return report(error.what(), kBadInput);
  } catch (const std::exception& error) {
    return report(error.what(), kFailure);
  }
  const int signal = received_stop_signal();
  return signal == 0 ? 0 : 128 + signal;
}
