// SPDX-License-Identifier: Apache-2.0
// Tracking with one's own camera and detector: needs the components track and, for the network,
// reid; no OpenCV.
//
//   find_package(sdmt REQUIRED COMPONENTS reid track)
//   target_link_libraries(own_detector PRIVATE sdmt::track sdmt::reid)
#include <sdmt/image/color_histogram.h>
#include <sdmt/reid/embedder.h>
#include <sdmt/track/tracker.h>

#include <cstdint>
#include <cstdio>
#include <memory>
#include <vector>

using namespace sdmt;

// Stand-ins for a camera and a detector: a red person walks across a grey square.
struct Camera {
  static constexpr int kWidth = 320, kHeight = 240, kFrames = 200;
  int frame = 0;
  std::vector<std::uint8_t> pixels;

  int person_left() const { return 10 + frame; }
  bool read(image::ImageView& image) {
    if (++frame > kFrames) return false;
    pixels.assign(std::size_t{3} * kWidth * kHeight, 128);
    for (int y = 80; y < 160; ++y) {
      for (int x = person_left(); x < person_left() + 32; ++x) {
        std::uint8_t* pixel = &pixels[3 * (std::size_t{kWidth} * y + x)];
        pixel[0] = 40, pixel[1] = 40, pixel[2] = 200;
      }
    }
    image = {pixels.data(), kWidth, kHeight, 3 * kWidth, image::ChannelOrder::bgr};
    return true;
  }
};

std::vector<mot::Detection> detect(const Camera& camera) {
  // Boxes are left, top, width, height; the first pixel is 1. The score is a probability.
  return {{{camera.person_left() + 1.0, 81, 32, 80}, 0.95}};
}

int main(int argc, char** argv) {
  std::unique_ptr<image::CropDescriptor> descriptor =
      std::make_unique<image::ColorHistogramDescriptor>();
  if (argc > 1) descriptor = std::make_unique<reid::Embedder>(reid::load_model(argv[1]));

  const auto show = [](const std::vector<track::FinishedFrame>& finished) {
    for (const track::FinishedFrame& frame : finished)
      for (const track::TrackedBox& person : frame.boxes)
        std::printf("frame %d: person %d at %.0f,%.0f\n", frame.frame, person.id, person.box.left,
                    person.box.top);
  };

  Camera camera;
  image::ImageView image;
  track::Tracker tracker(track::TrackerOptions{}, descriptor.get());
  while (camera.read(image)) show(tracker.update(detect(camera), &image));
  show(tracker.finish());
}
