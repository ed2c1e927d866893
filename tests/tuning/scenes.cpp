// SPDX-License-Identifier: Apache-2.0
#include "tuning/scenes.h"

#include <filesystem>

#include "sdmt/io/checked_value.h"

namespace sdmt::tuning {

namespace {

std::string row(int frame, int id, int left, const char* rest) {
  return io::number_text(frame) + "," + io::number_text(id) + "," + io::number_text(left) +
         ",30,20,50," + rest + "\n";
}

void write_scene(const std::filesystem::path& folder, int pace) {
  std::string truth, boxes;
  for (int frame = 1; frame <= Scenes::kFrames; ++frame) {
    for (const int person : {1, 2}) {
      const int left = person * 90 + frame * pace;
      truth += row(frame, person, left, "1,-1,-1,-1");
      if ((frame + person) % (4 + pace) != 0) boxes += row(frame, -1, left, "0.9,-1,-1,-1");
    }
    if (frame % 3 == 0) boxes += row(frame, -1, 300 - frame, "0.4,-1,-1,-1");
  }
  for (const char* part : {"gt", "det"}) std::filesystem::create_directories(folder / part);
  tests::write_file(folder / "gt/gt.txt", truth);
  tests::write_file(folder / "det/det.txt", boxes);
  tests::write_file(folder / "det/other.txt", boxes);
  tests::write_file(folder / "seqinfo.ini",
                    "[Sequence]\nname=x\nimDir=img1\nframeRate=10\nseqLength=" +
                        io::number_text(Scenes::kFrames) +
                        "\nimWidth=320\nimHeight=180\nimExt=.ppm\n");
}

}  // namespace

Scenes::Scenes() {
  write_scene(folder_ / "s1", 2);
  write_scene(folder_ / "s2", 3);
}

TuningOptions Scenes::options() const {
  TuningOptions options;
  options.sequences = {path()};
  options.tuned = {{"min-length", {"2", "6", "9"}}, {"min-iou", {"0.1", "0.3", "0.5"}}};
  options.draws = 2;
  options.drop = 0.2;
  return options;
}

}  // namespace sdmt::tuning
