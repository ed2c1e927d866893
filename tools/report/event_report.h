// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "evaluation/evaluation.h"
#include "sdmt/eval/events.h"

namespace sdmt::tools {

/// The events of one sequence of an evaluation.
struct SequenceEvents {
  const SequenceEvaluation* sequence = nullptr;
  std::vector<eval::TrackingEvent> events;
};

/// What happened, in a few words: "12 -> 30, 1 frame after the last match".
std::string describe(const eval::TrackingEvent& event);
/// "123" or "123-140".
std::string frames_text(const eval::TrackingEvent& event);

/// A line an event: frames, kind, ids, box and what happened.
std::string to_text(std::span<const SequenceEvents> sequences);
/// {NAME: [{"event", "first_frame", "last_frame", "gt_id", "result_id", ..., "box"}]}
nlohmann::ordered_json to_json(std::span<const SequenceEvents> sequences);

/// Draws each frame in which an event starts: the people green, or orange where they are missed,
/// the results blue, the event red with its text. Writes FOLDER/SEQUENCE/000123.jpg and returns
/// their number; sequences without images are left out. Throws std::invalid_argument when `folder`
/// does not exist, std::runtime_error naming an image that cannot be read.
int draw_events(std::span<const SequenceEvents> sequences, const std::filesystem::path& folder);

}  // namespace sdmt::tools
