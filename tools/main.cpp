// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>
#include <omp.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <functional>
#include <memory>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "cli/command.h"
#include "cli/config_arguments.h"
#include "cli/console.h"
#include "cli/help_formatter.h"
#include "cli/processes.h"
#include "cli/run_record.h"
#include "cli/stop_signal.h"
#include "cli/suggestion.h"
#include "cli/thread_pool.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/io/output_file.h"
#include "sdmt/nn/simd_target.h"

namespace {

using namespace sdmt::tools;

constexpr int kFailure = 1;
constexpr int kBadInput = 2;

void replace_first(std::string& text, std::string_view part, std::string_view by) {
  if (const auto at = text.find(part); at != std::string::npos) text.replace(at, part.size(), by);
}

void add_commands(CLI::App& app) {
  add_ablate_command(app);
  add_tune_command(app);
  add_evaluate_command(app);
  add_count_command(app);
  add_detect_command(app);
  add_embed_command(app);
  add_init_model_command(app);
  add_inspect_command(app);
  add_manual_command(app);
  add_bench_command(app);
  add_train_embedder_command(app);
  add_adapt_command(app);
  add_track_command(app);
  add_validate_roc_command(app);
  CLI::App* synth = app.add_subcommand("synth", "Make practice data");
  synth->require_subcommand(1);
  add_synth_scene_command(*synth);
  add_synth_reid_command(*synth);
}

// What to tell whoever asks what went wrong: version, compiler, instruction set, OpenCV.
std::string version_text() {
  return fmt::format("sdmt {} ({}, {}, OpenCV {})", SDMT_VERSION, SDMT_BUILD,
                     sdmt::nn::simd_target(), cv::getVersionString());
}

// The words of libraries below us, where they are wanted.
void be_verbose() {
  set_verbosity(Verbosity::verbose);
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_INFO);
  setenv("OPENCV_FFMPEG_LOGLEVEL", "32", 1);  // AV_LOG_INFO
  detail("{}, {} threads\n", version_text(), omp_get_max_threads());
}

// Every command that does work gets --config, --threads, --quiet and --verbose.
void add_shared_options(CLI::App& app) {
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  for (CLI::App* command : commands) add_shared_options(*command);
  if (!commands.empty() || app.get_parent() == nullptr) return;
  app.parse_complete_callback(start_threads);
  app.add_option_function<std::vector<std::string>>(
         "--config", [](const std::vector<std::string>&) {},
         "JSON file of options, or the name of a shipped one (track-paper, ...); may be repeated, "
         "the later wins, options typed here win over all")
      ->allow_extra_args(false)
      ->type_name("FILE");
  app.add_option_function<int>(
         "--threads", [](int threads) { omp_set_num_threads(threads); },
         "Threads to use [all cores]; the results do not depend on it")
      ->check(CLI::Range(1, 1024).description(""));
  app.add_flag_callback(
      "-q,--quiet", [] { set_verbosity(Verbosity::quiet); },
      "No progress and no summary; warnings and results stay");
  app.add_flag_callback("-v,--verbose", be_verbose,
                        "Also say what is used, and let the libraries below speak");
}

// The libraries that we use must neither print nor start threads of their own.
void quiet_opencv() {
  cv::setNumThreads(1);
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
}

// A parse error, with the config file that the offending value came from.
std::string parse_message(const CLI::ParseError& error, const ExpandedArguments& expanded) {
  std::string message = error.what();
  // CLI11's words for an option given twice, and for a missing value, are hard to read.
  replace_first(message, "At Most 1 required but received",
                "expected once, number of times given:");
  if (message.ends_with(" missing")) {
    if (const auto at = message.rfind(": 1 required "); at != std::string::npos) {
      message.replace(at, std::string::npos, ": its value is missing");
    }
  }
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
  return message;
}

// The exit code of a run that did all it should, as far as its output was taken.
int finish(const std::function<int(const std::string&, int)>& report) {
  if (const int signal = received_stop_signal(); signal != 0) return 128 + signal;
  const int error = flush_standard_output();
  if (error == 0) return 0;
  // `sdmt ... | head` is no failure worth a word.
  if (error == EPIPE) return 128 + SIGPIPE;
  return report(std::string("standard output: write failed: ") + std::strerror(error), kFailure);
}

int run(int argc, char** argv) {
  open_standard_streams();
  const QuietLibraries quiet;
  // Writing to a closed pipe or beyond the largest file allowed fails with a message, and takes
  // what is half written along.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  CLI::App app{"Deep similarity metric learning for real-time pedestrian tracking"};
  app.name("sdmt");
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_version_flag("--version", version_text);
  app.require_subcommand(1);
  add_commands(app);
  // Not before: commands would inherit it.
  app.footer("sdmt help COMMAND, or sdmt COMMAND --help, lists the options of a command.");
  add_shared_options(app);
  quiet_opencv();

  std::vector<std::string> typed(argv + 1, argv + argc);
  if (!typed.empty() && typed[0] == "help") {
    typed.erase(typed.begin());
    typed.emplace_back("--help");
  }
  // Of the processes that train together the first speaks for all.
  if (!typed.empty() && typed[0] == "train-embedder" && launched_rank() > 0) silence_console();
  const auto report = [&](std::string message, int code) {
    std::replace(message.begin(), message.end(), '\n', ' ');  // one line, whatever a path holds
    say(stderr, "{}: {}\n", command_name(app, typed), sdmt::io::printable(message));
    let_launcher_pass_on();
    return code;
  };
  if (typed.empty()) return report("sdmt --help lists the commands", kBadInput);
  ExpandedArguments expanded;
  try {
    if (const char* target = std::getenv("SDMT_SIMD")) sdmt::nn::use_simd_target(target);
    refuse_unknown_words(app, typed);
    record_command_line(typed);
    expanded = expand_config(app, typed);
    app.parse(std::vector<std::string>(expanded.arguments.rbegin(),  // CLI11 wants the last first
                                       expanded.arguments.rend()));
  } catch (const CLI::Success& help) {
    std::ostringstream text;
    app.exit(help, text, text);
    write_console(stdout, text.str());
    return finish(report);
  } catch (const CLI::ParseError& error) {
    return report(parse_message(error, expanded), kBadInput);
  } catch (const sdmt::io::ReaderLeft&) {
    return 128 + SIGPIPE;
  } catch (const std::logic_error& error) {
    return report(error.what(), kBadInput);
  } catch (const std::bad_alloc&) {
    return report("out of memory", kFailure);
  } catch (const std::exception& error) {
    return report(error.what(), kFailure);
  }
  return finish(report);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (...) {  // even the message could not be made
    write_console(stderr, "sdmt: out of memory\n");
    return kFailure;
  }
}
