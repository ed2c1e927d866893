// SPDX-License-Identifier: Apache-2.0
#include "validation/validation_crops.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>

#include "sdmt/media/image_file.h"
#include "sdmt/mot/mot_file.h"
#include "sdmt/mot/sequence.h"
#include "sdmt/reid/market1501.h"
#include "sdmt/track/pixel_rect.h"

namespace sdmt::tools {

namespace {

namespace fs = std::filesystem;

void append(std::vector<ValidationCrop>& crops, const std::vector<reid::ReidImage>& images,
            bool query, bool gallery) {
  for (const auto& image : images) {
    // The protocol searches for people only.
    const bool person = image.pid != reid::kDistractorPid;
    crops.push_back({image.path, {}, image.pid, image.camid, query && person, gallery});
  }
}

std::vector<ValidationCrop> list_reid_set(const fs::path& folder) {
  std::vector<ValidationCrop> crops;
  const bool query = reid::has_split(folder, reid::Split::query);
  const bool gallery = reid::has_split(folder, reid::Split::gallery);
  if (query != gallery) {
    throw std::invalid_argument(fmt::format("{}: has no folder {}, expected both", folder.string(),
                                            query ? "bounding_box_test" : "query"));
  }
  if (!query) {
    append(crops, reid::list_reid_images(folder), true, true);
    return crops;
  }
  append(crops, reid::list_reid_images(reid::split_folder(folder, reid::Split::query)), true,
         false);
  append(crops, reid::list_reid_images(reid::split_folder(folder, reid::Split::gallery)), false,
         true);
  return crops;
}

std::vector<ValidationCrop> list_sequence(const fs::path& folder,
                                          const ValidationCropOptions& options) {
  const auto sequence = mot::Sequence::read(folder);
  auto width = sequence.width;
  auto height = sequence.height;
  if (width == 0 || height == 0) {
    const auto first = media::read_image(sequence.image(1));
    width = first.width;
    height = first.height;
  }
  std::vector<ValidationCrop> crops;
  for (const auto& row : mot::read_ground_truth(sequence.ground_truth())) {
    if ((row.frame - 1) % options.frame_step != 0 || row.category > 1) continue;
    if (!options.frames.contains(row.frame)) continue;
    const image::PixelRect rect = track::to_pixel_rect(row.box);
    const bool inside = std::round(rect.left) >= 0 && std::round(rect.top) >= 0 &&
                        std::round(rect.left + rect.width) <= width &&
                        std::round(rect.top + rect.height) <= height;
    if (!inside) continue;
    // Ids count from 1, but nothing forbids 0, which must not become a distractor.
    crops.push_back({sequence.image(row.frame), rect, row.id + 1, 0, true, true});
  }
  if (crops.empty()) {
    throw std::invalid_argument(fmt::format(
        "{}: no box lies inside the image in those of frames 1, {}, ... that are wanted",
        sequence.ground_truth().string(), 1 + options.frame_step));
  }
  return crops;
}

std::vector<ValidationCrop> list_distractors(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    throw std::invalid_argument(folder.string() + ": is no folder");
  }
  std::vector<ValidationCrop> crops;
  for (const auto& entry : fs::directory_iterator(folder)) {
    auto extension = entry.path().extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension != ".jpg" && extension != ".jpeg" && extension != ".png") continue;
    crops.push_back({entry.path(), {}, reid::kDistractorPid, 0, false, true});
  }
  if (crops.empty()) {
    throw std::invalid_argument(folder.string() + ": holds no .jpg, .jpeg or .png image");
  }
  std::sort(crops.begin(), crops.end(), [](const ValidationCrop& a, const ValidationCrop& b) {
    return a.image.filename() < b.image.filename();
  });
  return crops;
}

}  // namespace

std::string ValidationCrop::label() const {
  const auto name = image.stem().string();
  if (!rect) return name;
  return fmt::format("{} at {:.0f}, {:.0f}, {:.0f} x {:.0f}", name, rect->left, rect->top,
                     rect->width, rect->height);
}

std::vector<ValidationCrop> list_validation_crops(const ValidationCropOptions& options) {
  if (!fs::is_directory(options.data)) {
    throw std::invalid_argument(options.data.string() + ": is no folder");
  }
  if (options.frame_step < 1) {
    throw std::invalid_argument(
        fmt::format("frame_step is {}, expected at least 1", options.frame_step));
  }
  auto crops = mot::Sequence::is_sequence(options.data) ? list_sequence(options.data, options)
                                                        : list_reid_set(options.data);
  for (ValidationCrop& crop : crops) crop.root = options.data;
  if (!options.distractors.empty()) {
    auto distractors = list_distractors(options.distractors);
    for (ValidationCrop& crop : distractors) crop.root = options.distractors;
    crops.insert(crops.end(), distractors.begin(), distractors.end());
  }
  return crops;
}

}  // namespace sdmt::tools
