// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>

#include "sdmt/pipeline/live_source.h"

namespace sdmt::tools {

/// How cameras and streams are watched, as the command line describes it.
struct LiveArguments {
  pipeline::LiveOptions options;
  bool no_reconnect = false;

  /// `may_drop`: frames may be left out when newer ones are there. `tell` is told of losses. A
  /// signal ends waiting for a frame. Throws as pipeline::open_live_source().
  std::unique_ptr<pipeline::FrameSource> open(const std::string& input, bool may_drop,
                                              std::function<void(const std::string&)> tell) const;
};

/// Adds --timeout and --no-reconnect.
void add_live_arguments(CLI::App& command, LiveArguments& arguments);

/// What the progress line says of a camera or stream; empty for other inputs.
std::string live_note(const pipeline::FrameSource& frames);

}  // namespace sdmt::tools
