// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "sdmt/track/finished_frame.h"
#include "sdmt/zones/zone_plan.h"

namespace sdmt::zones {

enum class EventKind {
  in,        ///< somebody crossed a line to its "in" side
  out,       ///< and to the other
  enter,     ///< somebody is in an area
  leave,     ///< and is no longer
  continued  ///< one stay was counted as two, until the tracker joined two ids: one stay less
};
const char* to_string(EventKind kind);

/// Something that happened in a zone.
struct ZoneEvent {
  EventKind kind = EventKind::in;
  std::string zone;
  int id = 0;         ///< the person, as reported at that time
  int former_id = 0;  ///< `continued`: the id that is now `id`; else 0
  int frame = 0;      ///< when it happened; may lie before the frame that told it
  double time = 0;    ///< seconds, of that frame
  /// `enter`: seen to walk in, not found within (first seen there). `leave`: seen to walk out, not
  /// lost within. `in`, `out`: seen to cross, not known from the two ends of a gap.
  bool witnessed = true;
  double dwell = 0;  ///< `leave`: seconds within
};

/// The counts of a line, or of one hour of it.
struct LineCounts {
  std::int64_t in = 0;
  std::int64_t out = 0;
};

/// The counts of an area, or of one hour of it.
struct AreaCounts {
  std::int64_t stays = 0;  ///< that began
  std::int64_t ended = 0;
  double dwell = 0;     ///< seconds of the stays that ended
  double longest = 0;   ///< of them
  int inside = 0;       ///< people, now
  int most_inside = 0;  ///< people at once
  double mean_dwell() const { return ended > 0 ? dwell / static_cast<double>(ended) : 0; }
};

struct ZoneCounterOptions {
  /// The foot of a person has to be so far beyond a line or an edge before it counts, as a share of
  /// the height of the box: who stands on a line does not cross it again and again. 0..1. In an
  /// area never more than half of its depth.
  double margin = 0.05;
  /// Seconds after which a person who is not reported any more has gone. 0.1..600.
  double forget = 2;
  /// Seconds for which it is remembered who has gone, should the tracker find out later that
  /// somebody else is the same person; at least `forget`, at most 3600.
  double remember = 60;

  /// Throws std::invalid_argument for a value outside of its range.
  void validate() const;
};

/// Counts people who cross lines and stay in areas, by the middle of the lower edge of their boxes.
/// A count is final but for ids that the tracker joins later: those are corrected.
///
/// Memory depends on the people of the last `remember` seconds and on the hours counted.
class ZoneCounter {
 public:
  /// Throws std::invalid_argument as ZonePlan::validate() and ZoneCounterOptions::validate().
  explicit ZoneCounter(ZonePlan plan, ZoneCounterOptions options = {});

  /// Takes a finished frame at `time` seconds, and returns what it tells: first of joined ids, then
  /// of people in view by id, then of those who are gone. Holds until the next call. Throws
  /// std::invalid_argument when the time is not finite or lies before that of the frame before.
  const std::vector<ZoneEvent>& add(const track::FinishedFrame& frame, double time);

  /// The end: who is still inside leaves, at the time of the last sight. add() may not follow.
  const std::vector<ZoneEvent>& finish();

  const ZonePlan& plan() const { return plan_; }
  /// Counts by line and area, in the order of the plan.
  const std::vector<LineCounts>& lines() const { return lines_; }
  const std::vector<AreaCounts>& areas() const { return areas_; }
  /// The same for hours of the clock (time / 3600, rounded down) in which there was something.
  /// `inside` is the number at the last change within the hour.
  const std::map<std::int64_t, std::vector<LineCounts>>& line_hours() const { return line_hours_; }
  const std::map<std::int64_t, std::vector<AreaCounts>>& area_hours() const { return area_hours_; }

 private:
  struct Crossing {
    int side = 0;        // -1 or 1 once the foot was clearly on one; 0 before
    int first_side = 0;  // the first that was clear
    int net = 0;         // crossings between the line's ends since the side was clear
    int frame = 0;       // of the last of them
    double time = 0;
    bool witnessed = true;
  };
  struct Stay {
    int side = 0;        // 1 inside, -1 outside, 0 not clear yet, or not seen any more
    bool found = false;  // the last stay began unseen
    bool lost = false;   // and ended unseen
    double since = 0, until = 0;
  };
  struct Person {
    Point first_foot, foot;
    int seen_frame = 0;
    double seen = 0;
    bool gone = false;
    std::vector<Crossing> crossings;  // by line
    std::vector<Stay> stays;          // by area
  };

  void join(const track::IdMerge& merge);
  void join_stays(int id, int former_id, std::size_t area, const Person& older, Stay& newer);
  void join_crossings(int id, std::size_t line, const Person& older, Person& newer);
  void follow(int id, Person& person, const mot::Tlwh& box);
  void follow_line(int id, Person& person, std::size_t line, Point foot, double margin);
  void follow_area(int id, Person& person, std::size_t area, Point foot, double margin);
  void forget_people();
  void lose(int id, Person& person);

  void count_crossing(std::size_t line, int id, int direction, const Crossing& crossing);
  void enter(std::size_t area, int id, Stay& stay, bool found);
  void leave(std::size_t area, int id, Stay& stay, int frame, double time, bool lost);
  void resume(std::size_t area, int id, int former_id, Stay& stay);
  // Applies the change to the counts of the area and to those of the hour.
  template <typename Change>
  void count(std::size_t area, double time, Change&& change);

  ZonePlan plan_;
  ZoneCounterOptions options_;
  std::vector<double> area_depths_;
  std::map<int, Person> people_;
  std::vector<LineCounts> lines_;
  std::vector<AreaCounts> areas_;
  std::map<std::int64_t, std::vector<LineCounts>> line_hours_;
  std::map<std::int64_t, std::vector<AreaCounts>> area_hours_;
  std::vector<ZoneEvent> events_;
  int frame_ = 0;
  double time_ = 0;
  bool begun_ = false;
};

}  // namespace sdmt::zones
