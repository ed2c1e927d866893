// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/events.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <tuple>

#include "sdmt/io/checked_value.h"

namespace sdmt::eval {

namespace {

// What is known of a person while going through the frames.
struct Person {
  int last_frame = 0;  // last frame with ground truth; 0: none yet
  int last_match = 0;  // last frame with a match
  std::int64_t boxes = 0;
  TrackingEvent miss;  // the miss going on; boxes is 0 when there is none
};

struct ResultTrack {
  TrackingEvent event;  // as if it were false
  std::int64_t matched = 0;
};

class Finder {
 public:
  Finder(const PreparedSequence& sequence, const EventOptions& options)
      : sequence_(sequence),
        options_(options),
        people_(sequence.similarities.num_gt_ids),
        tracks_(sequence.similarities.num_result_ids) {}

  std::vector<TrackingEvent> find(const ClearMatches& matches) {
    for (std::size_t t = 0; t < matches.size(); ++t) frame(t, matches[t]);
    for (auto& person : people_) end_miss(person);
    for (const auto& track : tracks_) {
      const auto& event = track.event;
      if (static_cast<double>(track.matched) <
          options_.false_track_match * static_cast<double>(event.track_boxes)) {
        events_.push_back(event);
      }
    }
    // How long each person was there is known only now.
    for (auto& event : events_) {
      if (event.kind == EventKind::false_track) continue;
      const auto label =
          std::lower_bound(sequence_.gt_labels.begin(), sequence_.gt_labels.end(), event.gt_id);
      event.track_boxes = people_[label - sequence_.gt_labels.begin()].boxes;
    }
    std::sort(events_.begin(), events_.end(), [](const TrackingEvent& a, const TrackingEvent& b) {
      return std::tie(a.first_frame, a.kind, a.gt_id, a.result_id) <
             std::tie(b.first_frame, b.kind, b.gt_id, b.result_id);
    });
    return std::move(events_);
  }

 private:
  void frame(std::size_t t, const std::vector<ClearMatch>& matches) {
    const auto& now = sequence_.similarities.frames[t];
    const int number = static_cast<int>(t) + 1;
    std::vector<int> matched_results;
    matched_results.reserve(matches.size());
    for (const auto& match : matches) matched_results.push_back(match.result_id);
    std::sort(matched_results.begin(), matched_results.end());
    auto match = matches.begin();  // in the order of gt_ids
    for (std::size_t i = 0; i < now.gt_ids.size(); ++i) {
      const int gt_id = now.gt_ids[i];
      Person& person = people_[gt_id];
      const auto& box = sequence_.gt_boxes[t][i];
      if (match != matches.end() && match->gt_id == gt_id) {
        if (match->idsw) add_switch(*match, person, number, box);
        end_miss(person);
        person.last_match = number;
        ++match;
      } else {
        miss(person, gt_id, number, box);
      }
      person.last_frame = number;
      ++person.boxes;
    }
    for (std::size_t j = 0; j < now.result_ids.size(); ++j) {
      const int id = now.result_ids[j];
      const bool matched = std::binary_search(matched_results.begin(), matched_results.end(), id);
      add_result(tracks_[id], id, number, matched, sequence_.result_boxes[t][j]);
    }
  }

  void add_switch(const ClearMatch& match, const Person& person, int number, const mot::Tlwh& box) {
    TrackingEvent event;
    event.kind = EventKind::id_switch;
    event.first_frame = event.last_frame = number;
    event.gt_id = sequence_.gt_labels[match.gt_id];
    event.result_id = sequence_.result_labels[match.result_id];
    event.previous_result_id = sequence_.result_labels[match.previous_result_id];
    event.boxes = number - person.last_match;
    event.after_absence = person.last_frame != number - 1;
    event.box = box;
    events_.push_back(event);
  }

  void miss(Person& person, int gt_id, int number, const mot::Tlwh& box) {
    if (person.miss.boxes == 0) {
      person.miss.kind = EventKind::long_miss;
      person.miss.gt_id = sequence_.gt_labels[gt_id];
      person.miss.first_frame = number;
      person.miss.box = box;
    }
    person.miss.last_frame = number;
    ++person.miss.boxes;
  }

  void end_miss(Person& person) {
    if (person.miss.boxes >= options_.long_miss) events_.push_back(person.miss);
    person.miss.boxes = 0;
  }

  void add_result(ResultTrack& track, int result_id, int number, bool matched,
                  const mot::Tlwh& box) {
    TrackingEvent& event = track.event;
    if (event.track_boxes++ == 0) {
      event.kind = EventKind::false_track;
      event.result_id = sequence_.result_labels[result_id];
      event.first_frame = number;
      event.box = box;
    }
    event.last_frame = number;
    ++(matched ? track.matched : event.boxes);
  }

  const PreparedSequence& sequence_;
  const EventOptions& options_;
  std::vector<Person> people_;
  std::vector<ResultTrack> tracks_;
  std::vector<TrackingEvent> events_;
};

}  // namespace

std::string_view to_string(EventKind kind) {
  switch (kind) {
    case EventKind::id_switch:
      return "id switch";
    case EventKind::long_miss:
      return "long miss";
    case EventKind::false_track:
      return "false track";
  }
  throw std::logic_error("no such kind of event");
}

void EventOptions::validate() const {
  io::require(long_miss >= 1, "long_miss", long_miss, ">= 1");
  io::require_in("false_track_match", false_track_match, 0, 1);
}

std::vector<TrackingEvent> find_events(const PreparedSequence& sequence,
                                       const ClearMatches& matches, const EventOptions& options) {
  options.validate();
  return Finder(sequence, options).find(matches);
}

}  // namespace sdmt::eval
