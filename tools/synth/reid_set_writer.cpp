// SPDX-License-Identifier: Apache-2.0
#include "synth/reid_set_writer.h"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "cli/new_data_folder.h"
#include "sdmt/nn/random.h"
#include "synth/jpeg.h"
#include "synth/person_drawing.h"

namespace sdmt::tools {

namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 64;
constexpr int kHeight = 128;
// Scenes are painted larger, which softens edges, and in the shape of a detector's box; a crop is
// stretched to 64 x 128 as those of Market-1501 are.
constexpr int kSceneHeight = 256;
constexpr int kSceneWidth = 100;
constexpr int kCameras = 2;

constexpr std::uint64_t kLookStream = 1ULL << 32;
constexpr std::uint64_t kImageStream = 2ULL << 32;
constexpr std::uint64_t kBackgroundStream = 3ULL << 32;

int train_identities(const ReidSetOptions& options) { return options.identities * 2 / 3; }

int background_images(const ReidSetOptions& options) {
  return (options.identities - train_identities(options)) * options.images_per_identity / 4;
}

// Of walls, ground and things: mostly dull, seldom bright.
cv::Scalar random_color(nn::Random& random) {
  const double grey = random.uniform(30, 215);
  const double chroma = random.uniform() < 0.2 ? 110 : 35;
  return {grey + random.uniform(-chroma, chroma), grey + random.uniform(-chroma, chroma),
          grey + random.uniform(-chroma, chroma)};
}

// Ground and wall with things on them.
cv::Mat clutter(nn::Random& random) {
  cv::Mat image(kSceneHeight, kSceneWidth, CV_8UC3, random_color(random));
  const int horizon = cvRound(image.rows * random.uniform(0.35, 0.95));
  cv::rectangle(image, cv::Rect(0, horizon, image.cols, image.rows - horizon), random_color(random),
                cv::FILLED);
  const auto things = 3 + random.below(9);
  for (std::uint64_t i = 0; i < things; ++i) {
    const cv::Point at(cvRound(random.uniform(0, image.cols)),
                       cvRound(random.uniform(0, image.rows)));
    const cv::Size size(cvRound(random.uniform(3, 60)), cvRound(random.uniform(3, 90)));
    const cv::Scalar color = random_color(random);
    switch (random.below(3)) {
      case 0:
        cv::rectangle(image, cv::Rect(at - cv::Point(size) / 2, size), color, cv::FILLED);
        break;
      case 1:
        cv::ellipse(image, at, size / 2, random.uniform(0, 180), 0, 360, color, cv::FILLED,
                    cv::LINE_AA);
        break;
      default:
        cv::line(
            image, at,
            at + cv::Point(cvRound(random.uniform(-80, 80)), cvRound(random.uniform(-150, 150))),
            color, 1 + static_cast<int>(random.below(8)), cv::LINE_AA);
    }
  }
  cv::GaussianBlur(image, image, {}, random.uniform(0.8, 3.0));
  return image;
}

// Another walker, a post or something low in front of the person.
void occlude(cv::Mat& image, nn::Random& random) {
  const double kind = random.uniform();
  const bool left = random.below(2) == 0;
  if (kind < 0.4) {
    const PersonLook other = random_look(random);
    const PersonPose pose{random.uniform(), random.uniform(0, 360), 0};
    const double height = image.rows * random.uniform(0.8, 1.15);
    const double x = image.cols * (left ? random.uniform(-0.42, -0.22) : random.uniform(0.6, 0.8));
    draw_person(image, other, pose, {x, image.rows - height * 0.95, height * 0.41, height});
  } else if (kind < 0.7) {
    const int width = cvRound(image.cols * random.uniform(0.06, 0.16));
    const int x =
        cvRound(image.cols * (left ? random.uniform(0.05, 0.3) : random.uniform(0.6, 0.9)));
    cv::rectangle(image, cv::Rect(x, 0, width, image.rows), random_color(random), cv::FILLED);
  } else {
    const int height = cvRound(image.rows * random.uniform(0.12, 0.32));
    cv::rectangle(image, cv::Rect(0, image.rows - height, image.cols, height), random_color(random),
                  cv::FILLED);
  }
}

// What a camera of its own colours makes of the light: v -> gain * v^gamma for each channel.
cv::Mat photograph(const cv::Mat& scene, int camid, nn::Random& random) {
  const bool warm = camid == 1;
  const cv::Vec3d gains = warm ? cv::Vec3d(0.88, 1.0, 1.06) : cv::Vec3d(1.1, 0.97, 0.86);  // BGR
  const double gamma = (warm ? 0.95 : 1.15) * random.uniform(0.9, 1.1);
  const double exposure = random.uniform(0.7, 1.2);
  cv::Mat table(1, 256, CV_8UC3);
  for (int v = 0; v < 256; ++v) {
    for (int c = 0; c < 3; ++c) {
      const double lit = 255 * exposure * gains[c] * std::pow(v / 255.0, gamma);
      table.at<cv::Vec3b>(0, v)[c] = cv::saturate_cast<uchar>(lit);
    }
  }
  cv::Mat image;
  cv::resize(scene, image, {kWidth, kHeight}, 0, 0, cv::INTER_AREA);
  cv::LUT(image, table, image);
  if (random.uniform() < 0.5) cv::GaussianBlur(image, image, {}, random.uniform(0.3, 1.1));
  const double noise = random.uniform(0, 7);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      for (int c = 0; c < 3; ++c) {
        uchar& value = image.at<cv::Vec3b>(y, x)[c];
        value = cv::saturate_cast<uchar>(value + noise * random.normal());
      }
    }
  }
  return image;
}

cv::Mat person_image(const PersonLook& look, int camid, nn::Random& random) {
  cv::Mat scene = clutter(random);
  const PersonPose pose{random.uniform(), random.uniform(0, 360), random.uniform(-0.02, 0.02)};
  // As a detector crops: a little too large or small, off the middle.
  const double height = scene.rows * random.uniform(0.86, 1.06);
  const double x = scene.cols * 0.5 + scene.cols * random.uniform(-0.1, 0.1);
  const double y = (scene.rows - height) * 0.5 + scene.rows * random.uniform(-0.05, 0.05);
  draw_person(scene, look, pose, {x - 0.205 * height, y, 0.41 * height, height},
              random.uniform(0.75, 1.1));
  if (random.uniform() < 0.2) occlude(scene, random);
  return photograph(scene, camid, random);
}

// A false alarm of the detector.
cv::Mat background_image(int camid, nn::Random& random) {
  cv::Mat scene = clutter(random);
  if (random.uniform() < 0.7) occlude(scene, random);
  return photograph(scene, camid, random);
}

fs::path file_name(int pid, int camid, int serial) {
  return fmt::format("{:04}_c{}s1_{:06}_00.jpg", pid, camid, serial);
}

void check(const char* field, int value, int low, int high) {
  if (value >= low && value <= high) return;
  throw std::invalid_argument(fmt::format("{} is {}, expected {} to {}", field, value, low, high));
}

}  // namespace

int ReidSetOptions::images() const {
  return identities * images_per_identity + background_images(*this);
}

void ReidSetOptions::validate() const {
  check("identities", identities, 4, 9999);
  check("images_per_identity", images_per_identity, 2 * kCameras, 1000);
}

bool write_reid_set(const fs::path& folder, const ReidSetOptions& options,
                    const std::function<bool(int)>& progress) {
  options.validate();
  NewDataFolder unfinished(folder, {"bounding_box_train", "query", "bounding_box_test"});
  constexpr int kQuality = 90;
  int written = 0;
  for (int pid = 1; pid <= options.identities; ++pid) {
    nn::Random look_random(options.seed, kLookStream + static_cast<std::uint64_t>(pid));
    const PersonLook look = random_look(look_random);
    nn::Random random(options.seed, kImageStream + static_cast<std::uint64_t>(pid));
    for (int k = 0; k < options.images_per_identity; ++k) {
      const int camid = 1 + k % kCameras;
      const char* split = pid <= train_identities(options) ? "bounding_box_train"
                          : k < kCameras                   ? "query"
                                                           : "bounding_box_test";
      write_jpeg(folder / split / file_name(pid, camid, k), person_image(look, camid, random),
                 kQuality);
      if (!progress(++written)) return false;
    }
  }
  for (int k = 0; k < background_images(options); ++k) {
    nn::Random random(options.seed, kBackgroundStream + static_cast<std::uint64_t>(k));
    const int camid = 1 + k % kCameras;
    write_jpeg(folder / "bounding_box_test" / file_name(0, camid, k),
               background_image(camid, random), kQuality);
    if (!progress(++written)) return false;
  }
  unfinished.keep();
  return true;
}

}  // namespace sdmt::tools
