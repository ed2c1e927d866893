// SPDX-License-Identifier: Apache-2.0
#include "adaptation/observed_scene.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "sdmt/image/patch.h"
#include "sdmt/mot/sequence.h"
#include "sdmt/pipeline/frame_source.h"
#include "sdmt/pipeline/sequence_runner.h"
#include "sdmt/track/pixel_rect.h"
#include "sdmt/track/tracker.h"

namespace sdmt::tools {

namespace {

using SceneProgress = std::function<void(const char*, int, int)>;

struct Tracks {
  std::vector<train::SceneBox> boxes;  // that a detector saw
  int tracks = 0;
  FrameRange frames;  // that were looked at
  double rate = 0;    // frames a second, 0: not known
};

// The last frame that is wanted of a source; 0: not known.
int last_frame(const pipeline::FrameSource& frames, const FrameRange& range) {
  return frames.frame_count() > 0 ? std::min(frames.frame_count(), range.last) : 0;
}

Tracks track(const std::string& input, const SceneView& view, const Warning& warn,
             const SceneProgress& progress) {
  const auto frames = pipeline::open_frame_source(input);
  if (!frames->has_images()) {
    throw std::invalid_argument(input +
                                ": the sequence has no frames, and the network learns from "
                                "what is in them");
  }
  const auto boxes = view.detections.open(input);
  for (const auto& note : frames->notes()) warn(note);
  track::TrackerOptions options = view.tracker.options;
  for (const auto& note : pipeline::fit_to_scores(options, *boxes)) warn(note);
  pipeline::fit_to_picture(options, *frames, input);
  const auto appearance = view.tracker.load_appearance(warn);
  track::Tracker tracker(options, appearance.get());

  Tracks result;
  result.rate = frames->frame_rate();
  result.frames = {view.frames.first, view.frames.first - 1};
  const int before = view.frames.first - 1, last = last_frame(*frames, view.frames);
  pipeline::Frame passed_over;
  for (int i = 0; i < before; ++i) {
    if (!frames->next(passed_over, false)) return result;
  }
  pipeline::RunObservers observers;
  observers.warning = warn;
  observers.read = [&](const pipeline::Frame& frame) {
    result.frames.last = frame.number;
    progress("tracking", frame.number - before, last - before);
  };
  observers.stop = [&] { return result.frames.last >= view.frames.last; };
  observers.finished = [&](const track::FinishedFrame& frame, const pipeline::FrameTime&) {
    for (const track::TrackedBox& box : frame.boxes) {
      if (box.source != track::BoxSource::detected) continue;
      result.boxes.push_back({frame.frame + before, box.id, track::to_pixel_rect(box.box)});
    }
  };
  const auto run =
      pipeline::run_sequence(*frames, *boxes, tracker, appearance != nullptr, observers);
  if (run.failure != nullptr) std::rethrow_exception(run.failure);
  result.tracks = static_cast<int>(run.stats.tracks);
  return result;
}

image::Image cut_out(const image::Image& frame, const image::PixelRegion& region) {
  image::Image crop(region.width(), region.height());
  for (int y = 0; y < crop.height; ++y) {
    std::copy_n(frame.pixel(region.left, region.top + y), 3 * crop.width, crop.pixel(0, y));
  }
  return crop;
}

// A part of the scene's time before its crops are cut.
struct Part {
  std::vector<train::SceneBox> boxes;
  train::SceneEvidence evidence;
  std::vector<image::Image> crops;  // of evidence.boxes

  void find(const train::SceneCropOptions& options) {
    evidence = train::find_evidence(boxes, options);
    crops.resize(evidence.boxes.size());
  }
  // Without those that could not be cut.
  train::SceneCrops take() {
    train::SceneCrops result;
    result.met = std::move(evidence.met);
    for (std::size_t i = 0; i < crops.size(); ++i) {
      if (crops[i].bgr.empty()) continue;
      result.images.push_back(std::move(crops[i]));
      result.tracks.push_back(evidence.tracks[i]);
    }
    return result;
  }
};

void cut_crops(const std::string& input, std::vector<Part*> parts, const Warning& warn,
               const SceneProgress& progress) {
  struct Wanted {
    Part* part;
    std::size_t crop;
  };
  std::map<int, std::vector<Wanted>> by_frame;
  for (Part* part : parts) {
    for (std::size_t i = 0; i < part->evidence.boxes.size(); ++i) {
      by_frame[part->boxes[part->evidence.boxes[i]].frame].push_back({part, i});
    }
  }
  if (by_frame.empty()) return;
  const int last = by_frame.rbegin()->first;
  const auto frames = pipeline::open_frame_source(input);
  pipeline::Frame frame;
  for (int number = 1; number <= last; ++number) {
    const auto wanted = by_frame.find(number);
    if (!frames->next(frame, wanted != by_frame.end())) {
      throw std::runtime_error(
          fmt::format("{}: ends before frame {}, where people were found when it was read first",
                      input, number));
    }
    progress("cutting", number, last);
    if (wanted == by_frame.end()) continue;
    if (!frame.has_image()) {
      warn(frame.problem + "; nobody is cut out of it");
      continue;
    }
    for (const auto& [part, crop] : wanted->second) {
      const auto& rect = part->boxes[part->evidence.boxes[crop]].rect;
      const auto region = image::visible_region(frame.image.width, frame.image.height, rect);
      if (region) part->crops[crop] = cut_out(frame.image, *region);
    }
  }
}

}  // namespace

ObservedScene observe(const std::string& input, const SceneView& view, const Warning& warn,
                      const SceneProgress& progress) {
  if (pipeline::is_live(input) || input == "-") {
    throw std::invalid_argument(pipeline::display_name(input) +
                                ": is looked at twice, expected a video, a folder of images or a "
                                "sequence; record the camera first");
  }
  Tracks tracks = track(input, view, warn, progress);
  if (tracks.frames.last < tracks.frames.first) {
    throw std::invalid_argument(fmt::format("{}: has no frame {}", input, tracks.frames.first));
  }
  ObservedScene scene;
  scene.name = std::filesystem::weakly_canonical(input).filename().string();
  scene.frames = tracks.frames.last - tracks.frames.first + 1;
  scene.tracks = tracks.tracks;

  Part teaching, held_out;
  const int teaching_frames = static_cast<int>(std::lround(scene.frames * (1 - view.held_out)));
  for (const train::SceneBox& box : tracks.boxes) {
    const bool early = box.frame < tracks.frames.first + teaching_frames;
    (early ? teaching : held_out).boxes.push_back(box);
  }
  constexpr double kSecondsApart = 0.4;
  train::SceneCropOptions options;
  if (tracks.rate > 0) {
    options.gap = std::max(1, static_cast<int>(std::lround(kSecondsApart * tracks.rate)));
  }
  teaching.find(options);
  held_out.find(options);
  cut_crops(input, {&teaching, &held_out}, warn, progress);
  scene.teaching = teaching.take();
  scene.held_out = held_out.take();
  return scene;
}

}  // namespace sdmt::tools
