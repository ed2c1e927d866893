// SPDX-License-Identifier: Apache-2.0
#include "report/track_timeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/svg_plot.h"
#include "sdmt/eval/events.h"

namespace sdmt::tools {

namespace {

constexpr double kRow = 14, kBar = 9, kLeft = 58, kRight = 14, kTop = 8;
constexpr const char* kThere = "#e5e7eb";
constexpr const char* kFalse = "#475569";
constexpr const char* kSwitch = "#dc2626";
constexpr const char* kMuted = "#6b7280";
constexpr const char* kFont =
    "-apple-system,BlinkMacSystemFont,'Segoe UI',Inter,Roboto,'Helvetica Neue',Arial,sans-serif";

// Hues a golden ratio of the circle apart, so that neighbouring ids differ most.
std::string id_color(int id) {
  const double hue = std::fmod(210.0 + 137.508 * std::abs(id), 360.0);
  return fmt::format("hsl({:.0f},58%,{}%)", hue, id % 2 == 0 ? 52 : 44);
}

// Frames in a row with one result id, or none.
struct Run {
  int first = 0, last = 0;
  int result_id = -1;
};

struct Person {
  int label = 0;
  std::int64_t boxes = 0;
  std::vector<Run> there;    // of the ground truth
  std::vector<Run> matched;  // by result id
  std::vector<int> switches;
};

void extend(std::vector<Run>& runs, int frame, int result_id) {
  if (!runs.empty() && runs.back().last == frame - 1 && runs.back().result_id == result_id) {
    runs.back().last = frame;
  } else {
    runs.push_back({frame, frame, result_id});
  }
}

std::vector<Person> people_of(const SequenceEvaluation& sequence) {
  const auto& prepared = sequence.prepared;
  std::vector<Person> people(prepared.gt_labels.size());
  for (std::size_t i = 0; i < people.size(); ++i) people[i].label = prepared.gt_labels[i];
  for (std::size_t t = 0; t < prepared.similarities.frames.size(); ++t) {
    const int frame = static_cast<int>(t) + 1;
    for (const int id : prepared.similarities.frames[t].gt_ids) {
      Person& person = people[id];
      ++person.boxes;
      extend(person.there, frame, -1);
    }
    for (const auto& match : sequence.matches[t]) {
      Person& person = people[match.gt_id];
      extend(person.matched, frame, prepared.result_labels[match.result_id]);
      if (match.idsw) person.switches.push_back(frame);
    }
  }
  return people;
}

// Keeps the longest, by first frame.
template <typename Row, typename Length, typename First>
std::size_t keep_longest(std::vector<Row>& rows, int limit, Length length, First first) {
  const auto all = rows.size();
  std::stable_sort(rows.begin(), rows.end(),
                   [&](const Row& a, const Row& b) { return length(a) > length(b); });
  if (rows.size() > static_cast<std::size_t>(limit)) rows.resize(static_cast<std::size_t>(limit));
  std::stable_sort(rows.begin(), rows.end(),
                   [&](const Row& a, const Row& b) { return first(a) < first(b); });
  return all - rows.size();
}

class Timeline {
 public:
  Timeline(int num_frames, int width)
      : width_(width),
        scale_((width - kLeft - kRight) / std::max(1, num_frames)),
        num_frames_(num_frames) {}

  void add_heading(const std::string& text) {
    y_ += 4;
    body_ += fmt::format("<text x=\"{}\" y=\"{:.1f}\" font-weight=\"600\" fill=\"{}\">{}</text>\n",
                         0, y_ + 10, kMuted, escape_markup(text));
    y_ += 18;
  }
  void begin_row(const std::string& label) {
    body_ += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\" fill=\"{}\">{}</text>\n",
                         kLeft - 8, y_ + kBar - 0.5, kMuted, escape_markup(label));
  }
  void add_run(const Run& run, const std::string& color, const std::string& tip) {
    body_ += fmt::format(
        "<rect x=\"{:.2f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{}\" fill=\"{}\">"
        "<title>{}, frames {} to {}</title></rect>\n",
        x(run.first), y_, std::max(0.6, (run.last - run.first + 1) * scale_), kBar, color,
        escape_markup(tip), run.first, run.last);
  }
  void add_switch(int frame) {
    const double at = x(frame);
    body_ += fmt::format(
        "<path d=\"M{0:.2f} {1:.1f}v{2}m-3 {3}h6l-3 4.5z\" stroke=\"{4}\" stroke-width=\"1.6\" "
        "fill=\"{4}\"><title>identity switch, frame {5}</title></path>\n",
        at, y_ - 2, kBar + 4, -(kBar + 5.5), kSwitch, frame);
  }
  void end_row() { y_ += kRow; }

  std::string str(const std::string& label) {
    const double bottom = y_ + 4;
    std::string axis;
    double step = 10;
    for (int k = 0; num_frames_ / step > 12; ++k) step *= k % 3 == 1 ? 2.5 : 2;  // 20 50 100 ...
    for (double frame = 0; frame <= num_frames_; frame += step) {
      const double at = x(std::max(1.0, frame));
      axis += fmt::format(
          "<line x1=\"{0:.2f}\" y1=\"{1}\" x2=\"{0:.2f}\" y2=\"{2:.1f}\" stroke=\"#f1f5f9\"/>"
          "<text x=\"{0:.2f}\" y=\"{3:.1f}\" text-anchor=\"middle\" fill=\"{4}\">{5:.0f}</text>\n",
          at, kTop, bottom, bottom + 14, kMuted, std::max(1.0, frame));
    }
    axis += fmt::format(
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" fill=\"{}\">frame"
        "</text>\n",
        (kLeft + width_ - kRight) / 2, bottom + 30, kMuted);
    const double height = bottom + 36;
    return fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1:.0f}\" width=\"{0}\" "
        "height=\"{1:.0f}\" role=\"img\" aria-label=\"{2}\" font-family=\"{3}\" "
        "font-size=\"10.5\">\n<rect width=\"{0}\" height=\"{1:.0f}\" fill=\"#ffffff\"/>\n{4}{5}"
        "</svg>\n",
        width_, height, escape_markup(label), kFont, axis, body_);
  }

 private:
  double x(double frame) const { return kLeft + (frame - 1) * scale_; }

  int width_;
  double scale_;
  int num_frames_;
  double y_ = kTop;
  std::string body_;
};

std::vector<eval::TrackingEvent> false_tracks(const SequenceEvaluation& sequence) {
  auto events = eval::find_events(sequence.prepared, sequence.matches, {});
  std::erase_if(events, [](const eval::TrackingEvent& event) {
    return event.kind != eval::EventKind::false_track;
  });
  return events;
}

}  // namespace

std::string track_timeline_svg(const SequenceEvaluation& sequence, const TimelineOptions& options) {
  auto people = people_of(sequence);
  auto strangers = false_tracks(sequence);
  const auto hidden_people = keep_longest(
      people, options.max_people, [](const Person& p) { return p.boxes; },
      [](const Person& p) { return p.there.front().first; });
  const auto hidden_tracks = keep_longest(
      strangers, options.max_false, [](const eval::TrackingEvent& e) { return e.track_boxes; },
      [](const eval::TrackingEvent& e) { return e.first_frame; });

  const auto hidden = [](std::size_t count) {
    return count == 0 ? std::string() : fmt::format(" ({} shorter ones not shown)", count);
  };
  Timeline timeline(static_cast<int>(sequence.prepared.similarities.frames.size()), options.width);
  timeline.add_heading("People" + hidden(hidden_people));
  for (const auto& person : people) {
    timeline.begin_row(std::to_string(person.label));
    for (const auto& run : person.there) {
      timeline.add_run(run, kThere, fmt::format("person {} missed", person.label));
    }
    for (const auto& run : person.matched) {
      timeline.add_run(run, id_color(run.result_id),
                       fmt::format("person {} as result {}", person.label, run.result_id));
    }
    for (const int frame : person.switches) timeline.add_switch(frame);
    timeline.end_row();
  }
  if (!strangers.empty()) {
    timeline.add_heading("Result tracks that match nobody" + hidden(hidden_tracks));
  }
  for (const auto& track : strangers) {
    timeline.begin_row(std::to_string(track.result_id));
    timeline.add_run({track.first_frame, track.last_frame, track.result_id}, kFalse,
                     fmt::format("result {}: {} boxes", track.result_id, track.track_boxes));
    timeline.end_row();
  }
  return timeline.str("Tracks of " + sequence.prepared.name + " over time");
}

}  // namespace sdmt::tools
