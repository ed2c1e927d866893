// SPDX-License-Identifier: Apache-2.0
#include "evaluation/scoring_arguments.h"

namespace sdmt::tools {

void add_scoring_arguments(CLI::App& command, ScoringArguments& arguments,
                           const std::string& benchmark_help) {
  CLI::Option* benchmark = command.add_option("--benchmark", arguments.benchmark, benchmark_help)
                               ->type_name("MOT15|MOT16|MOT17|MOT20");
  if (!arguments.benchmark.empty()) benchmark->capture_default_str();
  command
      .add_option("--compat", arguments.compat,
                  "Count as TrackEval, or as the devkit of papers up to 2020")
      ->capture_default_str()
      ->type_name("trackeval|devkit");
  command.add_option("--json", arguments.json, "Write all scores here")->type_name("FILE");
  command
      .add_option("--report", arguments.report,
                  "Write a self-contained HTML page with tables, plots and the tracks over time")
      ->type_name("FILE");
}

const char* counted_as(eval::Compat compat) {
  return compat == eval::Compat::devkit ? "the MATLAB devkit" : "TrackEval";
}

}  // namespace sdmt::tools
