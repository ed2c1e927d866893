// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "sdmt/eval/benchmark.h"

namespace sdmt::tools {

/// How tracks are scored, and where the scores go: the options that evaluate and ablate share.
struct ScoringArguments {
  std::string benchmark;  ///< as eval::parse_benchmark() takes it
  std::string compat = "trackeval";
  std::string json = {};
  std::string report = {};
};

/// Adds --benchmark, --compat, --json and --report. `arguments` must live until the command line is
/// parsed; a benchmark that it holds is the default.
void add_scoring_arguments(CLI::App& command, ScoringArguments& arguments,
                           const std::string& benchmark_help);

/// "TrackEval" or "the MATLAB devkit".
const char* counted_as(eval::Compat compat);

}  // namespace sdmt::tools
