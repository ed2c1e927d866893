// SPDX-License-Identifier: Apache-2.0
#include "report/event_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "cli/text_table.h"
#include "sdmt/io/output_file.h"
#include "sdmt/media/image_file.h"
#include "sdmt/mot/sequence.h"
#include "sdmt/track/pixel_rect.h"

namespace sdmt::tools {

namespace fs = std::filesystem;
using eval::EventKind;
using eval::TrackingEvent;
using nlohmann::ordered_json;

namespace {

const cv::Scalar kFound(90, 170, 60), kMissed(0, 140, 255), kResult(230, 140, 40),
    kEvent(40, 40, 230), kInk(255, 255, 255);

std::string id_text(int id) { return id < 0 ? "" : std::to_string(id); }

cv::Rect2d rectangle(const mot::Tlwh& box) {
  const image::PixelRect rect = track::to_pixel_rect(box);
  return {rect.left, rect.top, rect.width, rect.height};
}

void draw_box(cv::Mat& image, const mot::Tlwh& box, const cv::Scalar& color, int thickness) {
  // Far-away boxes are cut first: drawing takes 16-bit coordinates.
  const auto visible = rectangle(box) & cv::Rect2d(-10, -10, image.cols + 20, image.rows + 20);
  if (!visible.empty()) cv::rectangle(image, visible, color, thickness, cv::LINE_AA);
}

// Text on a filled label whose lower left corner is at `at`, kept inside the image.
void draw_label(cv::Mat& image, cv::Point at, const std::string& text, const cv::Scalar& color) {
  int base = 0;
  const auto size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, 0.45, 1, &base);
  at.x = std::clamp(at.x, 0, std::max(0, image.cols - size.width - 6));
  at.y = std::clamp(at.y, size.height + 6, image.rows);
  cv::rectangle(image, cv::Rect(at.x, at.y - size.height - 6, size.width + 6, size.height + 6),
                color, cv::FILLED);
  cv::putText(image, text, {at.x + 3, at.y - 4}, cv::FONT_HERSHEY_SIMPLEX, 0.45, kInk, 1,
              cv::LINE_AA);
}

cv::Point top_left(const mot::Tlwh& box) {
  const auto clamped = [](double v) { return static_cast<int>(std::clamp(v, -1e4, 1e5)); };
  const image::PixelRect rect = track::to_pixel_rect(box);
  return {clamped(rect.left), clamped(rect.top - 2)};
}

void draw_frame(cv::Mat& image, const SequenceEvaluation& sequence, int frame,
                std::span<const TrackingEvent> events) {
  const int t = frame - 1;
  const auto& now = sequence.prepared.similarities.frames[t];
  const auto& matches = sequence.matches[t];
  for (std::size_t j = 0; j < now.result_ids.size(); ++j) {
    const auto& box = sequence.prepared.result_boxes[t][j];
    draw_box(image, box, kResult, 1);
    const int id = sequence.prepared.result_labels[now.result_ids[j]];
    draw_label(image, top_left(box), std::to_string(id), kResult);
  }
  for (std::size_t i = 0; i < now.gt_ids.size(); ++i) {
    const bool found =
        std::any_of(matches.begin(), matches.end(),
                    [&](const eval::ClearMatch& match) { return match.gt_id == now.gt_ids[i]; });
    draw_box(image, sequence.prepared.gt_boxes[t][i], found ? kFound : kMissed, 1);
  }
  for (const auto& event : events) {
    draw_box(image, event.box, kEvent, 3);
    auto below = top_left(event.box);
    below.y += static_cast<int>(std::clamp(event.box.height, 0.0, 1e4)) + 22;
    draw_label(image, below,
               fmt::format("{}{}: {}", eval::to_string(event.kind),
                           event.gt_id < 0 ? "" : fmt::format(" of person {}", event.gt_id),
                           describe(event)),
               kEvent);
  }
  draw_label(image, {0, 0}, fmt::format("{} frame {}", sequence.prepared.name, frame),
             cv::Scalar(60, 60, 60));
}

int draw_sequence(const SequenceEvents& each, const fs::path& folder) {
  const auto& sequence = *each.sequence;
  if (!mot::Sequence::is_sequence(sequence.folder)) return 0;
  const auto images = mot::Sequence::read(sequence.folder);
  if (!images.has_images()) return 0;
  const auto target = folder / sequence.prepared.name;
  fs::create_directories(target);
  int drawn = 0;
  for (std::size_t begin = 0; begin < each.events.size();) {
    const int frame = each.events[begin].first_frame;
    std::size_t end = begin;
    while (end < each.events.size() && each.events[end].first_frame == frame) ++end;
    const auto file = images.image(frame);
    image::Image pixels = media::read_image(file);
    cv::Mat image(pixels.height, pixels.width, CV_8UC3, pixels.bgr.data());
    draw_frame(image, sequence, frame, std::span(each.events).subspan(begin, end - begin));
    constexpr int kJpegQuality = 92;
    const auto jpeg = media::encode_jpeg(pixels, kJpegQuality);
    io::OutputFile out(target / fmt::format("{:06}.jpg", frame));
    out.write(jpeg.data(), jpeg.size());
    out.commit();
    ++drawn;
    begin = end;
  }
  return drawn;
}

}  // namespace

std::string describe(const TrackingEvent& event) {
  switch (event.kind) {
    case EventKind::id_switch:
      return fmt::format("{} -> {}, {} after the last match{}", event.previous_result_id,
                         event.result_id,
                         event.boxes == 1 ? "1 frame" : fmt::format("{} frames", event.boxes),
                         event.after_absence ? ", back after an absence" : "");
    case EventKind::long_miss:
      return fmt::format("{} of its {} boxes", event.boxes, event.track_boxes);
    case EventKind::false_track:
      return fmt::format("{} of its {} boxes match nobody", event.boxes, event.track_boxes);
  }
  throw std::logic_error("no such kind of event");
}

std::string frames_text(const TrackingEvent& event) {
  return event.first_frame == event.last_frame
             ? std::to_string(event.first_frame)
             : fmt::format("{}-{}", event.first_frame, event.last_frame);
}

std::string to_text(std::span<const SequenceEvents> sequences) {
  TextTable table({"sequence", "frames", "event", "person", "result", "box", "what"}, {2, 6});
  for (const auto& each : sequences) {
    for (const auto& event : each.events) {
      const auto& box = event.box;
      table.add_row(
          {each.sequence->prepared.name, frames_text(event),
           std::string(eval::to_string(event.kind)), id_text(event.gt_id), id_text(event.result_id),
           fmt::format("{:.0f},{:.0f},{:.0f},{:.0f}", box.left, box.top, box.width, box.height),
           describe(event)});
    }
  }
  return table.str();
}

ordered_json to_json(std::span<const SequenceEvents> sequences) {
  ordered_json json = ordered_json::object();
  for (const auto& each : sequences) {
    auto& list = json[each.sequence->prepared.name] = ordered_json::array();
    for (const auto& event : each.events) {
      ordered_json item;
      item["event"] = eval::to_string(event.kind);
      item["first_frame"] = event.first_frame;
      item["last_frame"] = event.last_frame;
      if (event.gt_id >= 0) item["gt_id"] = event.gt_id;
      if (event.result_id >= 0) item["result_id"] = event.result_id;
      if (event.kind == EventKind::id_switch) {
        item["previous_result_id"] = event.previous_result_id;
        item["frames_since_match"] = event.boxes;
        item["after_absence"] = event.after_absence;
      } else {
        item["boxes"] = event.boxes;
      }
      item["track_boxes"] = event.track_boxes;
      item["box"] = {event.box.left, event.box.top, event.box.width, event.box.height};
      list.push_back(std::move(item));
    }
  }
  return json;
}

int draw_events(std::span<const SequenceEvents> sequences, const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    throw std::invalid_argument(folder.string() + ": no such folder to draw into");
  }
  int drawn = 0;
  for (const auto& each : sequences) drawn += draw_sequence(each, folder);
  return drawn;
}

}  // namespace sdmt::tools
