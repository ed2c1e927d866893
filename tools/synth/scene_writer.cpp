// SPDX-License-Identifier: Apache-2.0
#include "synth/scene_writer.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "cli/new_data_folder.h"
#include "sdmt/io/output_file.h"
#include "synth/ground_camera.h"
#include "synth/jpeg.h"
#include "synth/plaza.h"
#include "synth/walkers.h"

namespace sdmt::tools {

namespace {

namespace fs = std::filesystem;

constexpr double kBoxAspect = 0.41;

// Something upright in one frame; far ones are drawn first.
struct Standing {
  double z = 0;
  cv::Rect2d box;
  const Walker* walker = nullptr;      // one of
  const Occluder* occluder = nullptr;  // these
};

std::vector<Standing> sorted_by_distance(const GroundCamera& camera, const Plaza& plaza,
                                         const Walkers& walkers) {
  std::vector<Standing> all;
  for (const Walker& walker : walkers.all()) {
    all.push_back(
        {walker.at.z, camera.upright_box(walker.at, walker.height, kBoxAspect), &walker, nullptr});
  }
  for (const Occluder& occluder : plaza.occluders()) {
    all.push_back({occluder.foot.z, plaza.hidden_box(occluder), nullptr, &occluder});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Standing& a, const Standing& b) { return a.z > b.z; });
  return all;
}

// Share of the box at `index` that lies in the image and that nothing nearer covers.
double visibility(const std::vector<Standing>& all, std::size_t index, cv::Size image) {
  constexpr int kColumns = 10;
  constexpr int kRows = 24;
  const cv::Rect2d& box = all[index].box;
  const cv::Rect2d frame(0, 0, image.width, image.height);
  int seen = 0;
  for (int i = 0; i < kColumns * kRows; ++i) {
    const cv::Point2d at(box.x + box.width * (i % kColumns + 0.5) / kColumns,
                         box.y + box.height * (static_cast<double>(i / kColumns) + 0.5) / kRows);
    const bool hidden =
        !frame.contains(at) ||
        std::any_of(all.begin() + static_cast<std::ptrdiff_t>(index) + 1, all.end(),
                    [&](const Standing& nearer) { return nearer.box.contains(at); });
    seen += hidden ? 0 : 1;
  }
  return static_cast<double>(seen) / (kColumns * kRows);
}

void draw_shadow(cv::Mat& image, const Standing& standing, double light) {
  const double width = standing.box.width * 1.2;
  const cv::Point2d centre(standing.box.x + standing.box.width / 2 + 0.3 * width,
                           standing.box.y + standing.box.height - 1);
  const cv::Rect2d area(centre.x - width, centre.y - width, 2 * width, 2 * width);
  const cv::Rect region = cv::Rect(area) & cv::Rect({0, 0}, image.size());
  if (region.empty()) return;
  cv::Mat part = image(region);
  cv::Mat dark = part.clone();
  cv::ellipse(
      dark, cv::RotatedRect(centre - cv::Point2d(region.tl()), cv::Size2d(width, 0.16 * width), -4),
      cv::Scalar::all(40), cv::FILLED, cv::LINE_AA);
  const double weight = 0.45 * light * light;
  cv::addWeighted(dark, weight, part, 1 - weight, 0, part);
}

void draw(cv::Mat& image, const Plaza& plaza, const std::vector<Standing>& all) {
  for (const Standing& standing : all) {
    const auto foot = standing.walker != nullptr ? standing.walker->at : standing.occluder->foot;
    draw_shadow(image, standing, plaza.light_at(foot));
  }
  for (const Standing& standing : all) {
    if (standing.occluder != nullptr) {
      plaza.draw(*standing.occluder, image);
      continue;
    }
    const Walker& walker = *standing.walker;
    PersonPose pose;
    pose.phase = walker.rest > 0 ? 0 : walker.phase;
    pose.facing = walker.facing;
    draw_person(image, walker.look, pose, standing.box, plaza.light_at(walker.at));
  }
}

// One row "frame,id,left,top,width,height,rest"; MOTChallenge counts the first pixel as 1.
std::string row(int frame, int id, const cv::Rect2d& box, const std::string& rest) {
  return fmt::format("{},{},{:.2f},{:.2f},{:.2f},{:.2f},{}\n", frame, id, box.x + 1, box.y + 1,
                     box.width, box.height, rest);
}

std::string detection_row(int frame, const cv::Rect2d& box, double score) {
  return row(frame, -1, box, fmt::format("{:.4f}", std::clamp(score, 0.01, 0.99)));
}

// What a detector might say of a person; empty when it misses it.
std::string detect(int frame, const cv::Rect2d& box, double visible, nn::Random& random) {
  const double chance = 0.96 / (1 + std::exp(-(visible - 0.4) / 0.09));
  const bool found = random.uniform() < chance;
  const double dx = random.normal();
  const double dy = random.normal();
  const double resize = 1 + 0.05 * random.normal();
  const double score = 0.45 + 0.45 * visible + 0.1 * random.normal();
  if (!found) return {};
  const double width = box.width * resize;
  const double height = box.height * resize;
  const double left = box.x + (box.width - width) / 2 + 0.07 * box.width * dx;
  const double top = box.y + (box.height - height) / 2 + 0.025 * box.height * dy;
  return detection_row(frame, {left, top, width, height}, score);
}

// Boxes where nobody is: 0.35 a frame on average.
std::string false_alarm(int frame, const GroundCamera& camera, nn::Random& random) {
  if (random.uniform() >= 0.35) return {};
  const double z = random.uniform(9, 27);
  const GroundPoint at{camera.half_width_at(z) * random.uniform(-0.95, 0.95), z};
  const auto box = camera.upright_box(at, random.uniform(1.3, 2.1), kBoxAspect);
  return detection_row(frame, box, 0.3 + 0.14 * random.normal());
}

std::string sequence_info(const fs::path& folder, const SceneOptions& options) {
  const auto name = fs::weakly_canonical(folder).filename().string();
  return fmt::format(
      "[Sequence]\nname={}\nimDir=img1\nframeRate={:g}\nseqLength={}\nimWidth={}\nimHeight={}\n"
      "imExt=.jpg\n",
      name, options.frame_rate, options.frames, options.width, options.height);
}

void check(const char* field, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw std::invalid_argument(
      fmt::format("{} is {:g}, expected {:g} to {:g}", field, value, low, high));
}

}  // namespace

void SceneOptions::validate() const {
  check("frames", frames, 1, 1000000);
  check("walkers", walkers, 1, 200);
  check("width", width, 160, 4096);
  check("height", height, 120, 4096);
  check("frame_rate", frame_rate, 1, 1000);
}

bool write_scene(const fs::path& folder, const SceneOptions& options,
                 const std::function<bool(int)>& progress) {
  options.validate();
  NewDataFolder unfinished(folder, {"img1", "gt", "det"});
  const GroundCamera camera({options.width, options.height});
  const Plaza plaza(camera, options.seed);
  Walkers walkers(camera, options.walkers, options.uniform, nn::Random(options.seed, 10));
  nn::Random detector(options.seed, 11);

  std::string truth;
  std::string detections;
  for (int frame = 1; frame <= options.frames; ++frame) {
    const auto standing = sorted_by_distance(camera, plaza, walkers);
    cv::Mat image = plaza.background().clone();
    draw(image, plaza, standing);
    write_jpeg(folder / "img1" / fmt::format("{:06}.jpg", frame), image, 90);
    for (std::size_t i = 0; i < standing.size(); ++i) {
      if (standing[i].walker == nullptr) continue;
      const cv::Rect2d& box = standing[i].box;
      const double visible = visibility(standing, i, camera.image());
      detections += detect(frame, box, visible, detector);
      // People outside the image are no ground truth.
      const bool inside = (box & cv::Rect2d(0, 0, options.width, options.height)).area() > 0;
      if (inside) {
        truth += row(frame, standing[i].walker->id, box, fmt::format("1,1,{:.3f}", visible));
      }
    }
    detections += false_alarm(frame, camera, detector);
    walkers.step(1 / options.frame_rate);
    if (!progress(frame)) return false;
  }
  io::write_text_file(folder / "gt" / "gt.txt", truth);
  io::write_text_file(folder / "det" / "det.txt", detections);
  io::write_text_file(folder / "seqinfo.ini", sequence_info(folder, options));
  unfinished.keep();
  return true;
}

}  // namespace sdmt::tools
