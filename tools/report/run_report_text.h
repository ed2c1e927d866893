// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sdmt/pipeline/sequence_runner.h"

namespace sdmt::tools {

/// Counts and speed as JSON: frames, detections, tracks, hz, hz_without_embedding, stage_ms (a
/// frame), embedded, peak_rss_mib, and more.
std::string run_report_json(const pipeline::RunReport& report);

/// One line, or two when frames were unreadable.
std::string run_summary(const pipeline::RunReport& report);

/// Milliseconds a frame by stage, rates and counts, as lines of text.
std::string stage_table(const pipeline::RunReport& report);

}  // namespace sdmt::tools
