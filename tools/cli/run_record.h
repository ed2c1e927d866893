// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

namespace sdmt::tools {

/// How this run came about, for its reports.

/// Kept for command_line(), by main() before the work.
void record_command_line(std::span<const std::string> arguments);

/// "sdmt evaluate --gt 'my data' ...", as a shell takes it; passwords in URLs are left out.
const std::string& command_line();

/// "2026-11-27 06:01 UTC": the time now, or that of the environment variable SOURCE_DATE_EPOCH
/// (seconds since 1970), with which reports of equal runs are equal.
std::string date_of_run();

}  // namespace sdmt::tools
