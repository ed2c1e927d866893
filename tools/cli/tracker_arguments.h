// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>

#include "sdmt/image/crop_descriptor.h"
#include "sdmt/track/tracker_options.h"

namespace sdmt::tools {

/// Is told of what is odd but not an error.
using Warning = std::function<void(const std::string&)>;

/// The tracker as the command line describes it: the tuned preset and what differs from it.
struct TrackerArguments {
  track::TrackerOptions options;
  std::string appearance = "network";  ///< network, histogram or none
  std::string model;                   ///< empty: the shipped one
  bool no_appearance = false;

  bool uses_appearance() const { return !no_appearance && appearance != "none"; }
  /// What tells people apart; nullptr when nothing does. Throws as reid::load_model().
  std::unique_ptr<image::CropDescriptor> load_appearance(const Warning& warning) const;
  /// As load_appearance(), for any number of trackers in threads of their own: they share one
  /// network, which describes the crops of all in one batch. The function may be called by any
  /// thread, and must outlive what it returns.
  std::function<std::unique_ptr<image::CropDescriptor>()> load_appearances(
      const Warning& warning) const;
};

/// An embedding network; an empty `file` means the shipped one. Warns when it holds no tau_a, and
/// takes that of reid::AffinityThreshold. Throws as reid::load_model().
std::unique_ptr<image::CropDescriptor> load_network_appearance(const std::string& file,
                                                               const Warning& warning);

/// Adds --model, --appearance, --no-appearance and an option for every entry of
/// track::tracker_option_table(); switches also as --no-NAME. `arguments` must live until the
/// command line is parsed. What TrackerOptions::validate() refuses is reported with the option.
void add_tracker_arguments(CLI::App& command, TrackerArguments& arguments);

}  // namespace sdmt::tools
