// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "sdmt/eval/clear.h"
#include "sdmt/eval/prepare.h"

namespace sdmt::eval {

enum class EventKind {
  id_switch,    ///< a person continues under another result id
  long_miss,    ///< a person is there and not matched for a long time
  false_track,  ///< a result track that follows nobody, or hardly ever
};
std::string_view to_string(EventKind kind);

/// A place in a sequence where a score was lost. Ids are those of the files, -1 where none.
struct TrackingEvent {
  EventKind kind = EventKind::id_switch;
  int first_frame = 0, last_frame = 0;  ///< 1-based; a switch has one frame
  int gt_id = -1;
  int result_id = -1;           ///< false track; new id of a switch
  int previous_result_id = -1;  ///< of a switch
  /// Switch: frames since the person's last match. Miss: boxes missed. False track: its boxes
  /// without a match.
  std::int64_t boxes = 0;
  std::int64_t track_boxes = 0;  ///< all boxes of the person, or of the false track
  bool after_absence = false;    ///< of a switch: the person was away in the frame before
  mot::Tlwh box;                 ///< of the person (false track: of the result) in first_frame
};

struct EventOptions {
  int long_miss = 25;  ///< boxes missed one after the other from which it is an event; >= 1
  double false_track_match = 0.2;  ///< a track matched in less than this part is false; 0..1

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// The events behind the counts of clear_mot(), by first frame, then kind, then id. Every counted
/// identity switch is one of them.
std::vector<TrackingEvent> find_events(const PreparedSequence& sequence,
                                       const ClearMatches& matches, const EventOptions& options);

}  // namespace sdmt::eval
