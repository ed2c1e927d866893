// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tracking/sequence_runner.h"

namespace sdmt::tools {

/// Counts and speed as JSON: frames, detections, tracks, hz, hz_without_embedding, stage_ms (a
/// frame), embedded, peak_rss_mib, and more.
std::string run_report_json(const RunReport& report);

/// One line, or two when frames were unreadable.
std::string run_summary(const RunReport& report);

/// Milliseconds a frame by stage, rates and counts, as lines of text.
std::string stage_table(const RunReport& report);

}  // namespace sdmt::tools
