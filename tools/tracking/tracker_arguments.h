// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "sdmt/track/appearance_model.h"
#include "sdmt/track/tracker_options.h"

namespace sdmt::tools {

/// The tracker as the command line describes it: the tuned preset and what differs from it.
struct TrackerArguments {
  track::TrackerOptions options;
  std::string appearance = "network";  ///< network, histogram or none
  std::string model;                   ///< empty: the shipped one
  bool no_appearance = false;

  bool uses_appearance() const { return !no_appearance && appearance != "none"; }
  /// The appearance model; nullptr when none is used. Throws as nn::load_model().
  std::unique_ptr<track::AppearanceModel> load_appearance() const;
};

/// Adds --model, --appearance, --no-appearance and an option for every entry of
/// track::tracker_option_table(); switches also as --no-NAME. `arguments` must live until the
/// command line is parsed. The ranges are checked by TrackerOptions::validate().
void add_tracker_arguments(CLI::App& command, TrackerArguments& arguments);

}  // namespace sdmt::tools
