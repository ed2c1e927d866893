// SPDX-License-Identifier: Apache-2.0
// Tracking with one's own camera and detector: needs the components nn and track, no OpenCV.
//
//   find_package(sdmt REQUIRED COMPONENTS nn track)
//   target_link_libraries(own_detector PRIVATE sdmt::track)
#include <sdmt/reid/model_file.h>
#include <sdmt/track/embedding_appearance.h>
#include <sdmt/track/histogram_appearance.h>
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
  std::unique_ptr<track::AppearanceModel> appearance =
      std::make_unique<track::HistogramAppearance>();
  if (argc > 1)
    appearance = std::make_unique<track::EmbeddingAppearance>(reid::load_model(argv[1]));

  const auto show = [](const std::vector<track::FinishedFrame>& finished) {
    for (const track::FinishedFrame& frame : finished)
      for (const track::TrackedBox& person : frame.boxes)
        std::printf("frame %d: person %d at %.0f,%.0f\n", frame.frame, person.id, person.box.left,
                    person.box.top);
  };

  Camera camera;
  image::ImageView image;
  track::Tracker tracker(track::TrackerOptions{}, appearance.get());
  while (camera.read(image)) show(tracker.update(detect(camera), &image));
  show(tracker.finish());
}
