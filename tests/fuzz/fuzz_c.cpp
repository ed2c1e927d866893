// SPDX-License-Identifier: Apache-2.0
// libsdmt through its C interface: the input is a program of calls. Whatever is passed, a call
// ends with a status and a text that agree, and what is finished is in order.
#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include "memory_file.h"
#include "sdmt.h"

namespace {

using sdmt::fuzz::require;

// The bytes of the input, taken piece by piece; zeros behind its end.
class Input {
 public:
  Input(const std::uint8_t* bytes, std::size_t count) : bytes_(bytes), left_(count) {}

  bool empty() const { return left_ == 0; }
  template <typename Value>
  Value take() {
    Value value{};
    const std::size_t size = std::min(sizeof(Value), left_);
    std::memcpy(&value, bytes_, size);
    bytes_ += size;
    left_ -= size;
    return value;
  }
  std::string text() {
    std::string text;
    for (int length = take<std::uint8_t>() % 24; length > 0; --length) text += take<char>();
    return text.c_str();
  }
  // Mostly what a detector gives, now and then any bytes.
  double number() {
    const auto kind = take<std::uint8_t>();
    return kind < 16 ? take<double>() : kind + take<std::uint8_t>() / 256.0;
  }
  const std::uint8_t* rest() const { return bytes_; }
  std::size_t left() const { return left_; }

 private:
  const std::uint8_t* bytes_;
  std::size_t left_;
};

struct Session {
  sdmt_error* error = sdmt_error_new();
  sdmt_options* options = sdmt_options_new(nullptr);
  sdmt_tracker* tracker = nullptr;
  bool embedded = false;
  int last_frame = 0;

  ~Session() {
    sdmt_tracker_free(tracker);
    sdmt_options_free(options);
    sdmt_error_free(error);
  }

  bool agreed(sdmt_status status) const {
    require(status == sdmt_error_status(error));
    require((status == SDMT_OK) == (std::strlen(sdmt_error_text(error)) == 0));
    return status == SDMT_OK;
  }

  void start(bool with_embeddings) {
    sdmt_tracker_free(tracker);
    embedded = with_embeddings;
    last_frame = 0;
    tracker = embedded ? sdmt_tracker_new_embedded(options, error)
                       : sdmt_tracker_new(options, nullptr, error);
    require((tracker != nullptr) == agreed(sdmt_error_status(error)));
  }

  void read_finished() {
    for (std::size_t i = 0; i < sdmt_tracker_finished(tracker); ++i) {
      const sdmt_frame* frame = sdmt_tracker_frame(tracker, i);
      require(sdmt_frame_number(frame) == ++last_frame);
      std::size_t count = 0;
      const sdmt_track* tracks = sdmt_frame_tracks(frame, &count);
      for (std::size_t k = 0; k < count; ++k) {
        require(k == 0 || tracks[k - 1].id < tracks[k].id);
        require(std::isfinite(tracks[k].box.left) && tracks[k].box.width > 0);
      }
    }
    require(sdmt_tracker_frame(tracker, sdmt_tracker_finished(tracker)) == nullptr);
  }

  // A zoom that went on for hundreds of frames would leave the range of every number.
  static sdmt_camera_motion motion(Input& in) {
    const auto small = [&in] { return in.take<std::int8_t>() / 16384.0; };
    return {1 + small(), small(), in.number() / 16, in.number() / 16};
  }

  void update(Input& in) {
    const auto flags = in.take<std::uint8_t>();
    std::vector<sdmt_detection> boxes(flags % 8);
    for (auto& [box, score] : boxes) {
      box = {in.number(), in.number(), in.number(), in.number()};
      score = in.number() / 256;
    }
    const std::size_t dimension = embedded ? 1 + in.take<std::uint8_t>() % 4 : 0;
    std::vector<float> vectors(boxes.size() * dimension);
    for (float& value : vectors) value = static_cast<float>(in.number());
    static const std::vector<std::uint8_t> pixels(3 * 64 * 64, 90);
    sdmt_image image{pixels.data(), 64, 64, 3 * 64, in.take<std::uint8_t>() % 3};
    if ((flags & 16) != 0) image.stride = in.take<std::int16_t>() % 192;
    if ((flags & 32) != 0) image.width = in.take<std::int32_t>();
    if (image.width > 64 || image.width * 3 > image.stride) image.data = nullptr;
    sdmt_input input{};
    input.size = (flags & 64) != 0 ? in.take<std::uint8_t>() : sizeof input;
    input.detections = boxes.data();
    input.count = boxes.size();
    input.image = (flags & 8) != 0 ? &image : nullptr;
    input.embeddings = vectors.empty() ? nullptr : vectors.data();
    input.dimension = dimension;
    const double time = in.number();
    if ((flags & 128) != 0) input.time = &time;
    const sdmt_camera_motion camera = motion(in);
    const bool moves = boxes.size() == 7;
    if (agreed(sdmt_tracker_update_moving(tracker, &input, moves ? &camera : nullptr, error))) {
      read_finished();
    }
  }

  void skip(Input& in) {
    const double time = in.number();
    const sdmt_camera_motion camera = motion(in);
    if (agreed(sdmt_tracker_skip_moving(tracker, &time, &camera, error))) read_finished();
  }

  // Into itself, with a byte of it changed or not.
  void save_and_restore(Input& in) {
    std::size_t size = 0;
    if (!agreed(sdmt_tracker_save(tracker, nullptr, &size, error))) return;
    std::vector<std::uint8_t> bytes(size);
    require(sdmt_tracker_save(tracker, bytes.data(), &size, error) == SDMT_OK);
    const auto change = in.take<std::uint8_t>();
    bytes[in.take<std::uint16_t>() % size] ^= change;
    const bool restored = agreed(sdmt_tracker_restore(tracker, bytes.data(), size, error));
    require(restored || change != 0);
  }

  void read_file(const Input& in) {
    static sdmt::fuzz::MemoryFile file;
    const auto path = file.fill(in.rest(), in.left());
    sdmt_detections* boxes = sdmt_detections_read(path.c_str(), nullptr, error);
    require((boxes != nullptr) == agreed(sdmt_error_status(error)));
    std::size_t count = 0;
    const sdmt_detection* last =
        sdmt_detections_frame(boxes, sdmt_detections_last_frame(boxes), &count);
    require((last != nullptr) == (count > 0));
    for (std::size_t i = 0; i < count; ++i) require(std::isfinite(last[i].score));
    sdmt_detections_free(boxes);
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  Input in(bytes, count);
  Session session;
  while (!in.empty()) {
    switch (in.take<std::uint8_t>() % 10) {
      case 0:
        session.start(false);
        break;
      case 1:
        session.start(true);
        break;
      case 2: {
        const std::string name = in.text();
        session.agreed(
            sdmt_options_set(session.options, name.c_str(), in.text().c_str(), session.error));
        break;
      }
      case 3:
        if (session.agreed(sdmt_tracker_finish(session.tracker, session.error))) {
          session.read_finished();
        }
        break;
      case 4:
        session.read_file(in);
        return 0;
      case 8:
        session.skip(in);
        break;
      case 9:
        session.save_and_restore(in);
        break;
      default:
        session.update(in);
    }
  }
  return 0;
}
