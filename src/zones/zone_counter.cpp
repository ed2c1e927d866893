// SPDX-License-Identifier: Apache-2.0
#include "sdmt/zones/zone_counter.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "geometry.h"
#include "sdmt/io/checked_value.h"

namespace sdmt::zones {

namespace {

std::int64_t hour(double time) { return static_cast<std::int64_t>(std::floor(time / 3600)); }

}  // namespace

const char* to_string(EventKind kind) {
  switch (kind) {
    case EventKind::in:
      return "in";
    case EventKind::out:
      return "out";
    case EventKind::enter:
      return "enter";
    case EventKind::leave:
      return "leave";
    case EventKind::continued:
      return "continued";
  }
  return "";
}

void ZoneCounterOptions::validate() const {
  io::require_in("margin", margin, 0, 1);
  io::require_in("forget", forget, 0.1, 600);
  io::require_in("remember", remember, forget, 3600);
}

ZoneCounter::ZoneCounter(ZonePlan plan, ZoneCounterOptions options)
    : plan_(std::move(plan)),
      options_(options),
      lines_(plan_.lines.size()),
      areas_(plan_.areas.size()) {
  plan_.validate();
  options_.validate();
  for (const Area& area : plan_.areas) area_depths_.push_back(depth(area));
}

const std::vector<ZoneEvent>& ZoneCounter::add(const track::FinishedFrame& frame, double time) {
  if (!std::isfinite(time) || (begun_ && time < time_)) {
    io::refuse_value("time of frame " + std::to_string(frame.frame), io::number_text(time),
                     "not before the last one, " + io::number_text(time_));
  }
  events_.clear();
  frame_ = frame.frame;
  time_ = time;
  begun_ = true;
  for (const track::IdMerge& merge : frame.merges) join(merge);
  for (const track::TrackedBox& box : frame.boxes) follow(box.id, people_[box.id], box.box);
  forget_people();
  return events_;
}

const std::vector<ZoneEvent>& ZoneCounter::finish() {
  events_.clear();
  for (auto& [id, person] : people_) {
    if (!person.gone) lose(id, person);
  }
  people_.clear();
  return events_;
}

void ZoneCounter::follow(int id, Person& person, const mot::Tlwh& box) {
  const Point foot{box.left + box.width / 2, box.top + box.height};
  if (person.crossings.empty() && person.stays.empty()) {
    person.crossings.resize(plan_.lines.size());
    person.stays.resize(plan_.areas.size());
    person.first_foot = person.foot = foot;
  }
  const double margin = options_.margin * box.height;
  for (std::size_t i = 0; i < plan_.lines.size(); ++i) follow_line(id, person, i, foot, margin);
  for (std::size_t i = 0; i < plan_.areas.size(); ++i) follow_area(id, person, i, foot, margin);
  person.foot = foot;
  person.seen_frame = frame_;
  person.seen = time_;
  person.gone = false;
}

void ZoneCounter::follow_line(int id, Person& person, std::size_t line, Point foot, double margin) {
  Crossing& crossing = person.crossings[line];
  if (const int step = zones::crossing(plan_.lines[line], person.foot, foot); step != 0) {
    crossing.net += step;
    crossing.frame = frame_;
    crossing.time = time_;
    crossing.witnessed = frame_ == person.seen_frame + 1;
  }
  const double distance = signed_distance(plan_.lines[line], foot);
  if (std::abs(distance) < margin) return;
  const int side = distance >= 0 ? 1 : -1;
  if (crossing.side == 0) {
    crossing.first_side = side;
  } else if (side != crossing.side && crossing.net != 0) {
    count_crossing(line, id, crossing.net, crossing);
  }
  crossing.side = side;
  crossing.net = 0;
}

void ZoneCounter::follow_area(int id, Person& person, std::size_t area, Point foot, double margin) {
  Stay& stay = person.stays[area];
  if (edge_distance(plan_.areas[area], foot) < std::min(margin, area_depths_[area] / 2)) return;
  const int side = contains(plan_.areas[area], foot) ? 1 : -1;
  if (side == stay.side) return;
  if (side == -1) {
    if (stay.side == 1) leave(area, id, stay, frame_, time_, false);
  } else if (stay.lost) {
    resume(area, id, id, stay);
  } else {
    enter(area, id, stay, stay.side == 0);
  }
  stay.side = side;
  stay.lost = false;
}

void ZoneCounter::forget_people() {
  for (auto person = people_.begin(); person != people_.end();) {
    const double unseen = time_ - person->second.seen;
    if (!person->second.gone && unseen > options_.forget) lose(person->first, person->second);
    person = unseen > options_.remember ? people_.erase(person) : std::next(person);
  }
}

void ZoneCounter::lose(int id, Person& person) {
  person.gone = true;
  for (std::size_t i = 0; i < person.stays.size(); ++i) {
    Stay& stay = person.stays[i];
    stay.lost = stay.side == 1;
    if (stay.lost) leave(i, id, stay, person.seen_frame, person.seen, true);
    stay.side = 0;
  }
}

void ZoneCounter::join(const track::IdMerge& merge) {
  const auto from = people_.find(merge.from);
  if (from == people_.end()) return;
  Person newer = std::move(from->second);
  people_.erase(from);
  const auto to = people_.find(merge.to);
  if (to != people_.end()) {
    const Person& older = to->second;
    for (std::size_t i = 0; i < plan_.areas.size(); ++i) {
      join_stays(merge.to, merge.from, i, older, newer.stays[i]);
    }
    for (std::size_t i = 0; i < plan_.lines.size(); ++i) {
      join_crossings(merge.to, i, older, newer);
    }
    newer.first_foot = older.first_foot;
  }
  people_[merge.to] = std::move(newer);
}

void ZoneCounter::join_stays(int id, int former_id, std::size_t area, const Person& older,
                             Stay& newer) {
  Stay before = older.stays[area];
  const bool stayed = newer.side == 1 && newer.found;
  if (before.side == 1 && stayed) {
    count(area, time_, [](AreaCounts& counts) {
      --counts.stays;
      --counts.inside;
    });
    events_.push_back({EventKind::continued, plan_.areas[area].name, id, former_id, frame_, time_});
    newer.since = before.since;
    newer.found = before.found;
  } else if (before.side == 1 && newer.side == -1) {
    leave(area, id, before, older.seen_frame, older.seen, true);
  } else if (before.lost && stayed) {
    // Two stays that are counted become one that goes on.
    count(area, time_, [](AreaCounts& counts) {
      --counts.stays;
      --counts.inside;
    });
    resume(area, id, former_id, before);
    newer.since = before.since;
    newer.found = before.found;
  } else if (newer.side == 0) {
    newer = before;
  }
}

void ZoneCounter::join_crossings(int id, std::size_t line, const Person& older, Person& newer) {
  const Crossing& before = older.crossings[line];
  Crossing& after = newer.crossings[line];
  if (before.side == 0) return;
  const int step = zones::crossing(plan_.lines[line], older.foot, newer.first_foot);
  if (after.side == 0) {
    after.side = before.side;
    after.net += before.net + step;
    after.frame = frame_;
    after.time = time_;
    after.witnessed = step == 0;
  } else if (after.first_side != before.side && before.net + step != 0) {
    count_crossing(line, id, before.net + step,
                   {.frame = frame_, .time = time_, .witnessed = false});
  }
  after.first_side = before.first_side;
}

void ZoneCounter::count_crossing(std::size_t line, int id, int direction,
                                 const Crossing& crossing) {
  auto& hours = line_hours_[hour(crossing.time)];
  hours.resize(lines_.size());
  for (LineCounts* counts : {&lines_[line], &hours[line]}) {
    ++(direction > 0 ? counts->in : counts->out);
  }
  events_.push_back({direction > 0 ? EventKind::in : EventKind::out, plan_.lines[line].name, id, 0,
                     crossing.frame, crossing.time, crossing.witnessed});
}

template <typename Change>
void ZoneCounter::count(std::size_t area, double time, Change&& change) {
  auto& hours = area_hours_[hour(time)];
  hours.resize(areas_.size());
  change(areas_[area]);
  change(hours[area]);
  hours[area].inside = areas_[area].inside;
  for (AreaCounts* counts : {&areas_[area], &hours[area]}) {
    counts->most_inside = std::max(counts->most_inside, areas_[area].inside);
  }
}

void ZoneCounter::enter(std::size_t area, int id, Stay& stay, bool found) {
  stay.found = found;
  stay.since = time_;
  count(area, time_, [](AreaCounts& counts) {
    ++counts.stays;
    ++counts.inside;
  });
  events_.push_back({EventKind::enter, plan_.areas[area].name, id, 0, frame_, time_, !found});
}

void ZoneCounter::leave(std::size_t area, int id, Stay& stay, int frame, double time, bool lost) {
  stay.until = time;
  const double dwell = time - stay.since;
  count(area, time, [dwell](AreaCounts& counts) {
    ++counts.ended;
    counts.dwell += dwell;
    counts.longest = std::max(counts.longest, dwell);
    --counts.inside;
  });
  events_.push_back({EventKind::leave, plan_.areas[area].name, id, 0, frame, time, !lost, dwell});
}

void ZoneCounter::resume(std::size_t area, int id, int former_id, Stay& stay) {
  const double dwell = stay.until - stay.since;
  count(area, stay.until, [dwell](AreaCounts& counts) {
    --counts.ended;
    counts.dwell -= dwell;
  });
  count(area, time_, [](AreaCounts& counts) { ++counts.inside; });
  events_.push_back({EventKind::continued, plan_.areas[area].name, id, former_id, frame_, time_});
}

}  // namespace sdmt::zones
