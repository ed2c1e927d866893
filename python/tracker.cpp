// SPDX-License-Identifier: Apache-2.0
// sdmt.Tracker, sdmt.Embedder, sdmt.Model and what they give.
#include "sdmt/track/tracker.h"

#include <pybind11/stl.h>

#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

#include "arrays.h"
#include "module.h"
#include "option_texts.h"
#include "sdmt/image/camera_motion.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/reid/embedder.h"
#include "sdmt/track/given_embeddings.h"
#include "sdmt/track/pixel_rect.h"
#include "sdmt/track/tracker_option_table.h"

namespace sdmt::python {

namespace {

using FramePointer = std::shared_ptr<track::FinishedFrame>;

struct PythonModel {
  // An embedder gives up what only training needs.
  explicit PythonModel(const std::string& path)
      : model(reid::Embedder(reid::load_model(path)).model()) {}

  std::shared_ptr<const reid::Model> model;
};

image::ChannelOrder parse_order(const std::string& order) {
  if (order == "bgr") return image::ChannelOrder::bgr;
  if (order == "rgb") return image::ChannelOrder::rgb;
  io::refuse_value("order", io::quoted(order), "bgr or rgb");
}

// A 2 x 3 matrix as a motion. A zoom of 0 and the like are the tracker's to refuse.
std::optional<image::CameraMotion> to_motion(const py::object& camera) {
  if (camera.is_none()) return std::nullopt;
  const auto matrix = to_array<Doubles>(camera, "camera");
  require_shape(matrix.ndim() == 2 && matrix.shape(0) == 2 && matrix.shape(1) == 3, "camera",
                matrix, "(2, 3)");
  const auto m = matrix.unchecked<2>();
  constexpr double kTolerance = 1e-6;  // of who computes in float
  if (!(std::abs(m(0, 0) - m(1, 1)) <= kTolerance && std::abs(m(0, 1) + m(1, 0)) <= kTolerance)) {
    throw std::invalid_argument(
        "camera is no shift, zoom and roll, expected ((a, -b, tx), (b, a, "
        "ty)), as cv2.estimateAffinePartial2D gives it");
  }
  return image::CameraMotion{m(0, 0), m(1, 0), m(0, 2), m(1, 2)};
}

// What is known of a frame beside its boxes: pixels are looked at where they lie, so it must not
// outlive the objects that it was made of.
class Frame {
 public:
  Frame(const py::object& image, image::ChannelOrder order, std::optional<double> time,
        const py::object& camera) {
    if (!image.is_none()) view_ = to_image(image, order, owner_);
    time_ = time;
    camera_ = to_motion(camera);
  }

  // Vectors were given: nobody looks at the pixels.
  void needs_no_image() {
    static constexpr std::uint8_t kPixel[3] = {};
    view_ = image::ImageView{kPixel, 1, 1, 3, image::ChannelOrder::bgr};
  }
  track::FrameContext context() const {
    return {.image = view_ ? &*view_ : nullptr, .time = time_, .camera = camera_};
  }

 private:
  py::object owner_;
  std::optional<image::ImageView> view_;
  std::optional<double> time_;
  std::optional<image::CameraMotion> camera_;
};

// A tracker with its appearance, safe to be used by several threads: one after the other.
class PythonTracker {
 public:
  PythonTracker(const PythonModel* model, bool embeddings, const std::string& order,
                const OptionTexts& options)
      : order_(parse_order(order)) {
    if (model != nullptr && embeddings) {
      throw std::invalid_argument("model and embeddings=True are both given, expected one of them");
    }
    if (model != nullptr) descriptor_ = std::make_unique<reid::Embedder>(model->model);
    if (embeddings) {
      auto given = std::make_unique<track::GivenEmbeddings>();
      given_ = given.get();
      descriptor_ = std::move(given);
    }
    tracker_ = std::make_unique<track::Tracker>(
        to_options(options, track::tracker_option_table(), "tracker"), descriptor_.get());
  }

  std::vector<FramePointer> update(const py::object& boxes, const py::object& scores,
                                   const py::object& image, std::optional<double> time,
                                   const py::object& embeddings, const py::object& camera) {
    const auto detections = to_detections(boxes, scores);
    std::vector<float> vectors;
    if (!embeddings.is_none() || (given_ != nullptr && !detections.empty())) {
      vectors = to_vectors(embeddings, detections.size());
    }
    Frame frame(image, order_, time, camera);
    if (given_ != nullptr) frame.needs_no_image();
    const py::gil_scoped_release free;
    const std::scoped_lock lock(mutex_);
    if (given_ != nullptr) given_->set(detections, vectors);
    return copies(tracker_->update(detections, frame.context()));
  }

  std::vector<FramePointer> skip(const py::object& image, std::optional<double> time,
                                 const py::object& camera) {
    const Frame frame(image, order_, time, camera);
    const py::gil_scoped_release free;
    const std::scoped_lock lock(mutex_);
    return copies(tracker_->skip(frame.context()));
  }

  std::vector<FramePointer> finish() {
    const py::gil_scoped_release free;
    const std::scoped_lock lock(mutex_);
    return copies(tracker_->finish());
  }

  py::bytes save() {
    std::vector<std::byte> snapshot;
    {
      const py::gil_scoped_release free;
      const std::scoped_lock lock(mutex_);
      snapshot = tracker_->save();
    }
    return {reinterpret_cast<const char*>(snapshot.data()), snapshot.size()};
  }

  void restore(const py::bytes& snapshot) {
    const std::string bytes = snapshot;
    const py::gil_scoped_release free;
    const std::scoped_lock lock(mutex_);
    tracker_->restore(std::as_bytes(std::span(bytes)));
  }

  track::TrackerStats stats() {
    const py::gil_scoped_release free;
    const std::scoped_lock lock(mutex_);
    return tracker_->stats();
  }

 private:
  std::vector<float> to_vectors(const py::object& embeddings, std::size_t count) const {
    if (given_ == nullptr) {
      throw std::invalid_argument("embeddings are given: make the tracker with embeddings=True");
    }
    if (embeddings.is_none()) {
      throw std::invalid_argument("embeddings are None, expected a vector for each box, shape (" +
                                  std::to_string(count) + ", d)");
    }
    const auto values = to_array<Floats>(embeddings, "embeddings");
    require_shape(
        count == 0 || (values.ndim() == 2 && static_cast<std::size_t>(values.shape(0)) == count),
        "embeddings", values,
        ("(" + std::to_string(count) + ", d), a vector for each box").c_str());
    std::vector<float> vectors(values.data(), values.data() + values.size());
    track::scale_to_unit_rows(vectors, count);
    return vectors;
  }

  static std::vector<FramePointer> copies(const std::vector<track::FinishedFrame>& frames) {
    std::vector<FramePointer> copied;
    for (const auto& frame : frames) {
      copied.push_back(std::make_shared<track::FinishedFrame>(frame));
    }
    return copied;
  }

  image::ChannelOrder order_;
  std::unique_ptr<image::CropDescriptor> descriptor_;
  track::GivenEmbeddings* given_ = nullptr;  // the descriptor, where it is of this kind
  std::unique_ptr<track::Tracker> tracker_;
  std::mutex mutex_;
};

class PythonEmbedder {
 public:
  PythonEmbedder(const PythonModel& model, const std::string& order)
      : order_(parse_order(order)), embedder_(model.model) {}

  py::tuple embed(const py::object& image, const py::object& boxes) {
    py::object owner;
    const image::ImageView view = to_image(image, order_, owner);
    std::vector<image::Crop> crops;
    for (const mot::Tlwh& box : to_boxes(boxes)) crops.push_back({view, track::to_pixel_rect(box)});
    auto rows = std::make_unique<image::DescriptorRows>();
    rows->dimension = embedder_.dimension();
    {
      const py::gil_scoped_release free;
      const std::scoped_lock lock(mutex_);
      if (!crops.empty()) embedder_.describe(crops, *rows);
    }
    const py::ssize_t count = static_cast<py::ssize_t>(crops.size());
    const float* values = rows->values.data();
    py::array_t<bool> valid(count);
    for (py::ssize_t i = 0; i < count; ++i) {
      valid.mutable_at(i) = rows->valid[static_cast<std::size_t>(i)] != 0;
    }
    const int dimension = rows->dimension;
    const py::capsule keeper(
        rows.release(), [](void* owned) { delete static_cast<image::DescriptorRows*>(owned); });
    return py::make_tuple(
        py::array_t<float>({count, static_cast<py::ssize_t>(dimension)}, values, keeper), valid);
  }

  const reid::Embedder& embedder() const { return embedder_; }

 private:
  image::ChannelOrder order_;
  reid::Embedder embedder_;
  std::mutex mutex_;
};

class PythonCameraMotionEstimator {
 public:
  explicit PythonCameraMotionEstimator(const std::string& order) : order_(parse_order(order)) {}

  py::object next(const py::object& image, const py::object& boxes) {
    py::object owner;
    const image::ImageView view = to_image(image, order_, owner);
    std::vector<image::PixelRect> people;
    for (const mot::Tlwh& box : to_boxes(boxes)) people.push_back(track::to_pixel_rect(box));
    std::optional<image::CameraMotion> motion;
    {
      const py::gil_scoped_release free;
      const std::scoped_lock lock(mutex_);
      motion = estimator_.next(view, people);
    }
    if (!motion) return py::none();
    const double rows[] = {motion->a, 0 - motion->b, motion->tx, motion->b, motion->a, motion->ty};
    return py::array_t<double>({2, 3}, rows);
  }

 private:
  image::ChannelOrder order_;
  image::CameraMotionEstimator estimator_;
  std::mutex mutex_;
};

template <typename Value>
py::array frame_column(const FramePointer& frame, Value track::TrackedBox::*field) {
  const Value* first = frame->boxes.empty() ? nullptr : &(frame->boxes.front().*field);
  return column(std::span<const track::TrackedBox>(frame->boxes), first, 1, py::cast(frame));
}

py::array frame_boxes(const FramePointer& frame) {
  const double* first = frame->boxes.empty() ? nullptr : &frame->boxes.front().box.left;
  return column(std::span<const track::TrackedBox>(frame->boxes), first, 4, py::cast(frame));
}

py::array frame_corners(const FramePointer& frame) {
  py::array_t<double> corners({static_cast<py::ssize_t>(frame->boxes.size()), py::ssize_t{4}});
  double* value = corners.mutable_data();
  for (const track::TrackedBox& person : frame->boxes) {
    const auto rect = track::to_pixel_rect(person.box);
    for (const double side :
         {rect.left, rect.top, rect.left + rect.width, rect.top + rect.height}) {
      *value++ = side;
    }
  }
  return corners;
}

py::array frame_merges(const FramePointer& frame) {
  const int* first = frame->merges.empty() ? nullptr : &frame->merges.front().from;
  return column(std::span<const track::IdMerge>(frame->merges), first, 2, py::cast(frame));
}

py::array frame_sources(const FramePointer& frame) {
  static_assert(sizeof(track::BoxSource) == sizeof(int));
  const auto* first =
      frame->boxes.empty() ? nullptr : reinterpret_cast<const int*>(&frame->boxes.front().source);
  return column(std::span<const track::TrackedBox>(frame->boxes), first, 1, py::cast(frame));
}

std::string frame_text(const track::FinishedFrame& frame) {
  return "<sdmt.FinishedFrame " + std::to_string(frame.frame) + ": " +
         std::to_string(frame.boxes.size()) + " people>";
}

py::dict stats_dict(const track::TrackerStats& stats) {
  using namespace py::literals;
  return py::dict("frames"_a = stats.frames, "detections"_a = stats.detections,
                  "suppressed"_a = stats.suppressed, "embedded"_a = stats.embedded,
                  "without_embedding"_a = stats.without_embedding, "tracklets"_a = stats.tracklets,
                  "boosted"_a = stats.boosted, "merges"_a = stats.merges, "tracks"_a = stats.tracks,
                  "seconds"_a = py::dict(
                      "predict"_a = stats.predict_seconds, "embed"_a = stats.embed_seconds,
                      "assign"_a = stats.assign_seconds, "boost"_a = stats.boost_seconds,
                      "associate"_a = stats.associate_seconds, "emit"_a = stats.emit_seconds));
}

std::vector<std::map<std::string, std::string>> option_rows() {
  std::vector<std::map<std::string, std::string>> rows;
  for (const auto& entry : track::tracker_option_table()) {
    rows.push_back({{"name", entry.name},
                    {"group", entry.group},
                    {"help", entry.help},
                    {"takes", entry.is_switch ? "bool" : entry.values},
                    {"default", entry.get({})}});
  }
  return rows;
}

}  // namespace

void add_tracker(py::module_& module) {
  using namespace py::literals;

  py::class_<PythonModel>(module, "_Model")
      .def(py::init<const std::string&>(), py::call_guard<py::gil_scoped_release>())
      .def_property_readonly(
          "dimension", [](const PythonModel& m) { return m.model->network.embedding_size(); },
          "Values of an embedding.")
      .def_property_readonly(
          "tau_a",
          [](const PythonModel& m) {
            const auto& tau_a = m.model->metadata.tau_a;
            return tau_a ? std::optional(tau_a->value) : std::nullopt;
          },
          "The stored threshold: two crops show one person when 1 - distance exceeds it; None "
          "where none is stored.")
      .def_property_readonly(
          "path", [](const PythonModel& m) { return m.model->source; }, "The file.");

  py::class_<track::FinishedFrame, FramePointer>(
      module, "FinishedFrame",
      "A frame about which the tracker will not change its mind. Its arrays are views, read-only, "
      "one row a person, by id.")
      .def_readonly("frame", &track::FinishedFrame::frame,
                    "1-based, in the order of the updates, none missing.")
      .def_property_readonly(
          "ids", [](const FramePointer& f) { return frame_column(f, &track::TrackedBox::id); },
          "int32 (n,): who, 1-based.")
      .def_property_readonly("boxes", &frame_boxes,
                             "float64 (n, 4): left, top, width, height in pixels, the first pixel "
                             "is 1, as given to update().")
      .def_property_readonly("xyxy", &frame_corners,
                             "float64 (n, 4): left, top, right, bottom, the first pixel begins at "
                             "0, as given to update_xyxy().")
      .def_property_readonly(
          "scores",
          [](const FramePointer& f) { return frame_column(f, &track::TrackedBox::score); },
          "float64 (n,): the detection's score; 0 where nothing was detected.")
      .def_property_readonly("sources", &frame_sources,
                             "int32 (n,): where the box comes from: sdmt.DETECTED, sdmt.BOOSTED or "
                             "sdmt.INTERPOLATED.")
      .def_property_readonly("merges", &frame_merges,
                             "int32 (m, 2): from this frame on the person known as the first id is "
                             "reported as the second. Rare with the default delay.")
      .def("__len__", [](const track::FinishedFrame& f) { return f.boxes.size(); })
      .def("__repr__", &frame_text);

  py::class_<PythonTracker>(module, "_Tracker")
      .def(py::init<const PythonModel*, bool, const std::string&, const OptionTexts&>())
      .def("update", &PythonTracker::update, "boxes"_a, "scores"_a = py::none(),
           "image"_a = py::none(), "time"_a = py::none(), "embeddings"_a = py::none(),
           "camera"_a = py::none(),
           R"(Takes the next frame and returns the frames finished by it, in order.

Call it for every frame, also for those without boxes or without an image.

boxes: (n, 4) numbers: left, top, width, height in pixels; the first pixel is 1, as in
    MOTChallenge's files. update_xyxy() takes corners that count from 0.
scores: (n,) of the detector: probabilities, unless the option calibration maps them to such.
    None: every box is certain.
image: uint8 (height, width, 3) in the tracker's channel order. It is looked at where it lies,
    during the call, and not copied, also when it is cut out of a larger one or its channels are
    turned round. None: the frame is tracked by motion.
time: seconds on any clock, which must rise. With the option frame_rate frames may come irregularly
    or not at all: those that never came are no misses. None: the frame is one after the last.
embeddings: (n, d) numbers, a vector for each box of a tracker made with embeddings=True; scaled
    to length 1.
camera: (2, 3) numbers ((a, -b, tx), (b, a, ty)), how the picture moved since the frame before
    because the camera did, as cv2.estimateAffinePartial2D and CameraMotionEstimator give it: a
    point (x, y) of the frame before is at (a x - b y + tx, b x + a y + ty) now; the first pixel
    begins at 0. Everything that the tracker knows moves along; boxes are reported where they are in their own frame. None: the
    camera stood still.

Raises ValueError for a box that is not finite, has no extent or lies beyond 1e12 pixels, a score
that is not finite, a time that does not rise, a shift of the camera beyond 1e6 pixels or a zoom
beyond 0.1..10, and shapes that do not fit; the tracker is then as if the call had not been made.
RuntimeError after finish().)")
      .def("skip", &PythonTracker::skip, "image"_a = py::none(), "time"_a = py::none(),
           "camera"_a = py::none(),
           "The next frame, at which no detector looked: people move on as predicted and nobody "
           "misses a detection. Returns and raises as update().")
      .def("save", &PythonTracker::save,
           "Everything that the tracker knows, as bytes: a tracker made alike that restores them "
           "goes on with the same output, in another process or on another machine. RuntimeError "
           "after finish().")
      .def("restore", &PythonTracker::restore, "snapshot"_a,
           "Goes on where save() was called. Raises ValueError for bytes that save() did not make, "
           "other options or another appearance; the tracker is then as it was.")
      .def("finish", &PythonTracker::finish,
           "The end of the input: returns all frames still held back. No update may follow.")
      .def(
          "state", [](PythonTracker& tracker) { return stats_dict(tracker.stats()); },
          "What the tracker has done so far: counts of frames, detections, suppressed, embedded, "
          "without_embedding, tracklets, boosted, merges and tracks (ids reported), and the "
          "seconds of each stage.");

  py::class_<PythonEmbedder>(module, "_Embedder")
      .def(py::init<const PythonModel&, const std::string&>())
      .def("embed", &PythonEmbedder::embed, "image"_a, "boxes"_a,
           R"(Embeds boxes of an image.

image: uint8 (height, width, 3), not copied; boxes: (n, 4) left, top, width, height, the first
    pixel is 1.
Returns vectors float32 (n, d), each of length 1, and valid bool (n,): False, with a row of zeros,
where less than a tenth of the box or less than 2 x 2 pixels lie in the image. The distance of two
rows says how unlike two people look. Raises ValueError for shapes and types that do not fit.)")
      .def_property_readonly(
          "dimension", [](const PythonEmbedder& e) { return e.embedder().dimension(); },
          "Values of an embedding.")
      .def_property_readonly(
          "tau_a", [](const PythonEmbedder& e) { return e.embedder().tau_a(); },
          "The model's threshold, see Model.tau_a.");

  py::class_<PythonCameraMotionEstimator>(
      module, "CameraMotionEstimator",
      R"(Finds how a camera moved from frame to frame, as `sdmt track --moving-camera` does.

order: of the channels, "bgr" or "rgb".

    motion = sdmt.CameraMotionEstimator()
    tracker.update(boxes, scores, image, camera=motion.next(image, boxes)))")
      .def(py::init<const std::string&>(), py::kw_only(), "order"_a = "bgr")
      .def("next", &PythonCameraMotionEstimator::next, "image"_a, "boxes"_a = py::list(),
           R"(The motion since the image given last, as Tracker.update() takes it.

image: uint8 (height, width, 3), not copied; boxes: (n, 4) of the people in it, left, top, width,
    height, the first pixel is 1: what moves by itself is left out.
Returns float64 (2, 3), ((a, -b, tx), (b, a, ty)); for the first image, and while the camera stands
still, exactly ((1, 0, 0), (0, 1, 0)). None where the motion could not be found: too little to go
by, another size, a cut. Raises ValueError for shapes and types that do not fit.)");

  module.def("tracker_options", &option_rows);
  module.attr("DETECTED") = static_cast<int>(track::BoxSource::detected);
  module.attr("BOOSTED") = static_cast<int>(track::BoxSource::boosted);
  module.attr("INTERPOLATED") = static_cast<int>(track::BoxSource::interpolated);
}

}  // namespace sdmt::python
