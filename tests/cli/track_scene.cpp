// SPDX-License-Identifier: Apache-2.0
#include "cli/track_scene.h"

#include <filesystem>

namespace sdmt::tests {

std::string TrackScene::motion_sequence(const std::string& name, int frames, int people) {
  std::filesystem::create_directories(folder_ / (name + "/det"));
  write_file(folder_ / (name + "/seqinfo.ini"),
             "[Sequence]\nname=" + name + "\nframeRate=25\nseqLength=" + std::to_string(frames) +
                 "\nimWidth=1000\nimHeight=500\n");
  std::string rows;
  for (int frame = 1; frame <= frames; ++frame) {
    for (int person = 0; person < people; ++person) {
      rows += std::to_string(frame) + ",-1," + std::to_string(frame % 800 + 5 * person) + "," +
              std::to_string(100 * person) + ",40,90,0.9" + std::to_string(person) + "\n";
    }
  }
  write_file(folder_ / (name + "/det/det.txt"), rows);
  return folder_ / name;
}

std::string TrackScene::picture_sequence(const std::string& name, int frames) {
  const auto made =
      run_sdmt({"synth", "scene", "--output", folder_ / name, "--frames", std::to_string(frames),
                "--walkers", "5", "--width", "320", "--height", "180", "--seed", "2"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  return folder_ / name;
}

CommandResult TrackScene::track(const std::string& input, std::vector<std::string> more) {
  std::vector<std::string> words{"track", input, "--output", folder_ / "tracks.txt"};
  words.insert(words.end(), more.begin(), more.end());
  return run_sdmt(words);
}

}  // namespace sdmt::tests
