// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/tracker.h"

#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "guard.h"
#include "handles.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/reid/embedder.h"
#include "sdmt/track/given_embeddings.h"
#include "sdmt/track/tracker_option_table.h"

using namespace sdmt;

struct sdmt_options {
  track::TrackerOptions options;
};

struct sdmt_frame {
  int number = 0;
  std::vector<sdmt_track> tracks;
  std::vector<sdmt_merge> merges;
};

struct sdmt_tracker {
  sdmt_tracker(const sdmt_options* options, std::unique_ptr<image::CropDescriptor> appearance,
               track::GivenEmbeddings* embeddings)
      : descriptor(std::move(appearance)),
        given(embeddings),
        tracker(options != nullptr ? options->options : track::TrackerOptions(), descriptor.get()) {
  }

  std::unique_ptr<image::CropDescriptor> descriptor;
  track::GivenEmbeddings* given;  // the descriptor, where it is of this kind
  track::Tracker tracker;
  std::vector<mot::Detection> detections;
  std::vector<float> vectors;
  std::vector<sdmt_frame> frames;

  void take(const sdmt_input& input, const sdmt_camera_motion* camera);
  void skip(const double* time, const sdmt_camera_motion* camera);
  void keep(const std::vector<track::FinishedFrame>& finished);
};

namespace {

sdmt_frame to_c(const track::FinishedFrame& finished) {
  sdmt_frame frame{finished.frame, {}, {}};
  for (const track::TrackedBox& box : finished.boxes) {
    frame.tracks.push_back({box.id, static_cast<int>(box.source), c::to_c(box.box), box.score});
  }
  for (const track::IdMerge& merge : finished.merges) {
    frame.merges.push_back({merge.from, merge.to});
  }
  return frame;
}

track::FrameContext frame_at(const double* time, const sdmt_camera_motion* camera) {
  track::FrameContext frame;
  if (time != nullptr) frame.time = *time;
  if (camera != nullptr) frame.camera = {camera->a, camera->b, camera->tx, camera->ty};
  return frame;
}

static_assert(SDMT_DETECTED == static_cast<int>(track::BoxSource::detected) &&
              SDMT_BOOSTED == static_cast<int>(track::BoxSource::boosted) &&
              SDMT_INTERPOLATED == static_cast<int>(track::BoxSource::interpolated));

}  // namespace

void sdmt_tracker::take(const sdmt_input& input, const sdmt_camera_motion* camera) {
  if (input.size != sizeof(sdmt_input)) {
    throw std::invalid_argument("input: size is " + std::to_string(input.size) +
                                ", expected sizeof(sdmt_input)");
  }
  if (input.count > 0) c::given(input.detections, "input: detections");
  std::optional<image::ImageView> view;
  if (input.image != nullptr) view = c::to_view(*input.image);
  detections.clear();
  for (std::size_t i = 0; i < input.count; ++i) {
    const sdmt_detection& detection = input.detections[i];
    detections.push_back({c::to_tlwh(detection.box), detection.score});
  }
  if (given == nullptr && input.embeddings != nullptr) {
    throw std::invalid_argument(
        "input: embeddings are given, expected NULL: make the tracker with "
        "sdmt_tracker_new_embedded");
  }
  if (given != nullptr) {
    if (input.count > 0) c::given(input.embeddings, "input: embeddings");
    vectors.assign(input.embeddings, input.embeddings + input.count * input.dimension);
    track::scale_to_unit_rows(vectors, input.count);
    given->set(detections, vectors);
    static constexpr std::uint8_t kPixel[3] = {};
    view = image::ImageView{kPixel, 1, 1, 3, image::ChannelOrder::bgr};  // it is not looked at
  }
  track::FrameContext frame = frame_at(input.time, camera);
  if (view) frame.image = &*view;
  keep(tracker.update(detections, frame));
}

void sdmt_tracker::skip(const double* time, const sdmt_camera_motion* camera) {
  keep(tracker.skip(frame_at(time, camera)));
}

void sdmt_tracker::keep(const std::vector<track::FinishedFrame>& finished) {
  frames.clear();
  for (const track::FinishedFrame& frame : finished) frames.push_back(to_c(frame));
}

sdmt_options* sdmt_options_new(sdmt_error* error) {
  return c::guarded_new(error, [] { return new sdmt_options; });
}
void sdmt_options_free(sdmt_options* options) { delete options; }

sdmt_status sdmt_options_set(sdmt_options* options, const char* name, const char* value,
                             sdmt_error* error) {
  return c::guarded(error, [&] {
    c::given(options, "options"), c::given(name, "name"), c::given(value, "value");
    track::TrackerOptions changed = options->options;
    track::tracker_option_table().named(name, "tracker").set(changed, value);
    changed.validate();
    options->options = changed;
  });
}

sdmt_tracker* sdmt_tracker_new(const sdmt_options* options, const sdmt_model* model,
                               sdmt_error* error) {
  return c::guarded_new(error, [&] {
    auto embedder = model != nullptr ? std::make_unique<reid::Embedder>(model->model) : nullptr;
    return new sdmt_tracker(options, std::move(embedder), nullptr);
  });
}

sdmt_tracker* sdmt_tracker_new_embedded(const sdmt_options* options, sdmt_error* error) {
  return c::guarded_new(error, [&] {
    auto given = std::make_unique<track::GivenEmbeddings>();
    track::GivenEmbeddings* embeddings = given.get();
    return new sdmt_tracker(options, std::move(given), embeddings);
  });
}
void sdmt_tracker_free(sdmt_tracker* tracker) { delete tracker; }

sdmt_status sdmt_tracker_update(sdmt_tracker* tracker, const sdmt_input* input, sdmt_error* error) {
  return sdmt_tracker_update_moving(tracker, input, nullptr, error);
}
sdmt_status sdmt_tracker_skip(sdmt_tracker* tracker, const double* time, sdmt_error* error) {
  return sdmt_tracker_skip_moving(tracker, time, nullptr, error);
}
sdmt_status sdmt_tracker_update_moving(sdmt_tracker* tracker, const sdmt_input* input,
                                       const sdmt_camera_motion* camera, sdmt_error* error) {
  return c::guarded(error,
                    [&] { c::given(tracker, "tracker").take(c::given(input, "input"), camera); });
}
sdmt_status sdmt_tracker_skip_moving(sdmt_tracker* tracker, const double* time,
                                     const sdmt_camera_motion* camera, sdmt_error* error) {
  return c::guarded(error, [&] { c::given(tracker, "tracker").skip(time, camera); });
}
sdmt_status sdmt_tracker_save(const sdmt_tracker* tracker, uint8_t* bytes, size_t* size,
                              sdmt_error* error) {
  return c::guarded(error, [&] {
    const auto snapshot = c::given(tracker, "tracker").tracker.save();
    const std::size_t room = c::given(size, "size");
    *size = snapshot.size();
    if (bytes == nullptr) return;
    io::require(room >= snapshot.size(), "size", room,
                io::number_text(snapshot.size()) + " or more");
    std::memcpy(bytes, snapshot.data(), snapshot.size());
  });
}
sdmt_status sdmt_tracker_restore(sdmt_tracker* tracker, const uint8_t* bytes, size_t size,
                                 sdmt_error* error) {
  return c::guarded(error, [&] {
    c::given(tracker, "tracker"), c::given(bytes, "bytes");
    tracker->tracker.restore(std::as_bytes(std::span(bytes, size)));
    tracker->frames.clear();
  });
}
sdmt_status sdmt_tracker_finish(sdmt_tracker* tracker, sdmt_error* error) {
  return c::guarded(error, [&] { c::given(tracker, "tracker").keep(tracker->tracker.finish()); });
}

size_t sdmt_tracker_finished(const sdmt_tracker* tracker) {
  return tracker != nullptr ? tracker->frames.size() : 0;
}
const sdmt_frame* sdmt_tracker_frame(const sdmt_tracker* tracker, size_t i) {
  return i < sdmt_tracker_finished(tracker) ? &tracker->frames[i] : nullptr;
}

int sdmt_frame_number(const sdmt_frame* frame) { return frame != nullptr ? frame->number : 0; }
const sdmt_track* sdmt_frame_tracks(const sdmt_frame* frame, size_t* count) {
  if (count != nullptr) *count = frame != nullptr ? frame->tracks.size() : 0;
  return frame != nullptr ? frame->tracks.data() : nullptr;
}
const sdmt_merge* sdmt_frame_merges(const sdmt_frame* frame, size_t* count) {
  if (count != nullptr) *count = frame != nullptr ? frame->merges.size() : 0;
  return frame != nullptr ? frame->merges.data() : nullptr;
}
