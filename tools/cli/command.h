// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

namespace sdmt::tools {

// Each command of the binary lives in tools/commands/<name>_command.cpp and has one function here.
// It adds its subcommand with its options to the parser; the subcommand's callback does the work.
// Callbacks throw: std::logic_error and its kinds (std::invalid_argument, ...) for bad usage or
// input, anything else for a failure while running. main() prints the one line and picks the exit
// code, and gives every command --config and --threads.

void add_ablate_command(CLI::App& app);
void add_adapt_command(CLI::App& app);
void add_tune_command(CLI::App& app);
void add_bench_command(CLI::App& app);
void add_count_command(CLI::App& app);
void add_detect_command(CLI::App& app);
void add_embed_command(CLI::App& app);
void add_evaluate_command(CLI::App& app);
void add_init_model_command(CLI::App& app);
void add_inspect_command(CLI::App& app);
void add_manual_command(CLI::App& app);
void add_synth_reid_command(CLI::App& synth);
void add_synth_scene_command(CLI::App& synth);
void add_track_command(CLI::App& app);
void add_train_embedder_command(CLI::App& app);
void add_validate_roc_command(CLI::App& app);

}  // namespace sdmt::tools
