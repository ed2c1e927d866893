// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

namespace sdmt::pipeline {

/// ISO 8601 in UTC, to the millisecond: 2026-03-01T14:05:09.250Z.
std::string utc_text(std::chrono::system_clock::time_point time);

}  // namespace sdmt::pipeline
