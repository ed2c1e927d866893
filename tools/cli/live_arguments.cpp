// SPDX-License-Identifier: Apache-2.0
#include "cli/live_arguments.h"

#include <fmt/core.h>

#include <utility>

#include "cli/stop_signal.h"

namespace sdmt::tools {

std::unique_ptr<pipeline::FrameSource> LiveArguments::open(
    const std::string& input, bool may_drop, std::function<void(const std::string&)> tell) const {
  pipeline::LiveOptions watching = options;
  watching.reconnect = !no_reconnect;
  watching.newest_only = may_drop;
  watching.stop = [] { return received_stop_signal() != 0; };
  watching.tell = std::move(tell);
  return pipeline::open_live_source(input, watching);
}

void add_live_arguments(CLI::App& command, LiveArguments& arguments) {
  command
      .add_option("--timeout", arguments.options.timeout,
                  "Seconds without a frame after which a camera or stream is lost, 0.1..3600")
      ->type_name("SECONDS")
      ->capture_default_str();
  command.add_flag("--no-reconnect", arguments.no_reconnect,
                   "End with exit code 1 when a camera or stream is lost; otherwise it is opened "
                   "again, as often as it takes");
}

std::string live_note(const pipeline::FrameSource& frames) {
  const auto counts = frames.live();
  if (!counts) return {};
  return fmt::format("{} dropped, {:.1f} s behind", counts->dropped, counts->lag);
}

}  // namespace sdmt::tools
