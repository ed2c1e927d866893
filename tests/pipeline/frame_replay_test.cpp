// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/frame_replay.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "cli/run_command.h"
#include "pipeline/unread_camera.h"
#include "sdmt/media/image_file.h"

namespace sdmt::pipeline {
namespace {

image::Image grey(std::uint8_t value) {
  image::Image image(16, 16);
  std::fill(image.bgr.begin(), image.bgr.end(), value);
  return image;
}

void add(FrameReplay& replay, int number, std::uint8_t value, bool keep) {
  Frame frame;
  frame.number = number;
  frame.image = grey(value);
  replay.add(frame, keep);
}

TEST(FrameReplay, KeepsOfACameraTheImagesThatAreWanted) {
  FrameReplay replay("camera:0", UnreadCamera());
  add(replay, 1, 40, true);
  add(replay, 2, 80, false);
  add(replay, 3, 120, true);
  add(replay, 4, 160, true);
  EXPECT_TRUE(replay.has_next_image());
  EXPECT_NEAR(replay.next().image.bgr[0], 40, 2);
  EXPECT_FALSE(replay.has_next_image());
  replay.skip();
  EXPECT_TRUE(replay.has_next_image());
  replay.skip();
  const Frame last = replay.next();
  EXPECT_EQ(last.number, 4);
  EXPECT_NEAR(last.image.bgr[0], 160, 2);
  EXPECT_FALSE(replay.has_next_image());
  EXPECT_NEAR(replay.next().image.bgr[0], 96, 0);  // nothing is known of it
}

TEST(FrameReplay, PassesOverFramesOfAFile) {
  const tests::TemporaryFolder folder;
  for (int i = 1; i <= 3; ++i) {
    const auto bytes = media::encode_png(grey(static_cast<std::uint8_t>(40 * i)));
    tests::write_file(folder / (std::to_string(i) + ".png"), {bytes.begin(), bytes.end()});
  }
  const auto source = open_frame_source(folder.path());
  FrameReplay replay(folder.path(), *source);
  EXPECT_FALSE(replay.keeps_images());
  EXPECT_TRUE(replay.has_next_image());
  replay.skip();
  EXPECT_EQ(replay.next().image.bgr[0], 80);
  replay.skip();
}

}  // namespace
}  // namespace sdmt::pipeline
