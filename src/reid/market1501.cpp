// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/market1501.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace sdmt::reid {

namespace {

namespace fs = std::filesystem;

const char* folder_name(Split split) {
  switch (split) {
    case Split::train:
      return "bounding_box_train";
    case Split::query:
      return "query";
    case Split::gallery:
      return "bounding_box_test";
  }
  return "";
}

bool is_image_name(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return extension == ".jpg" || extension == ".jpeg" || extension == ".png";
}

// Why a folder holds no images, as far as what lies there tells.
[[noreturn]] void refuse_without_images(const fs::path& folder, int folders, int other_files) {
  std::string there;
  if (folders > 0) {
    there = std::to_string(folders) +
            " folders; images of all people belong into one, named PID_cCAM... as in "
            "0002_c1s1_000451_03.jpg";
  } else if (other_files > 0) {
    there = std::to_string(other_files) + " files of other kinds";
  }
  throw std::invalid_argument(folder.string() + ": holds no .jpg or .png image" +
                              (there.empty() ? "" : ", but " + there));
}

// Sorted by name.
std::vector<fs::path> image_files(const fs::path& folder, LeftOut* left_out) {
  if (!fs::is_directory(folder)) {
    throw std::invalid_argument(folder.string() + ": no such folder");
  }
  std::vector<fs::path> files;
  int folders = 0, other_files = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const bool hidden = entry.path().filename().string().starts_with('.');
    const bool leads_nowhere = entry.is_symlink() && !entry.exists();
    folders += !hidden && entry.is_directory() ? 1 : 0;
    if (hidden || !(entry.is_regular_file() || leads_nowhere)) continue;
    if (is_image_name(entry.path())) {
      files.push_back(entry.path());
    } else {
      ++other_files;
    }
  }
  if (files.empty()) refuse_without_images(folder, folders, other_files);
  if (left_out != nullptr) left_out->other_files += other_files;
  std::sort(files.begin(), files.end());
  return files;
}

struct NameParts {
  int pid;
  int camid;
};

// PID_cCAM...; PID may be -1 (junk). Throws std::invalid_argument for one that is no int.
std::optional<NameParts> parse_name(const fs::path& file) {
  const std::string name = file.filename().string();
  NameParts parts{};
  const char* end = name.data() + name.size();
  const auto [after_pid, pid_error] = std::from_chars(name.data(), end, parts.pid);
  if (pid_error == std::errc::result_out_of_range) {
    throw std::invalid_argument(file.string() +
                                ": the person's number is out of range, "
                                "expected at most " +
                                std::to_string(std::numeric_limits<int>::max()));
  }
  if (pid_error != std::errc() || parts.pid < -1) return std::nullopt;
  if (end - after_pid < 3 || after_pid[0] != '_' || after_pid[1] != 'c') return std::nullopt;
  const auto [after_cam, cam_error] = std::from_chars(after_pid + 2, end, parts.camid);
  if (cam_error != std::errc() || parts.camid < 0) return std::nullopt;
  return parts;
}

}  // namespace

LeftOut& LeftOut::operator+=(const LeftOut& other) {
  background += other.background;
  junk += other.junk;
  other_files += other.other_files;
  return *this;
}

std::string LeftOut::text() const {
  std::string text;
  for (const auto& [count, what] :
       {std::pair(background, " of the background (pid 0000)"),
        std::pair(junk, " of no use (pid -1)"), std::pair(other_files, " neither .jpg nor .png")}) {
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + what;
  }
  return text;
}

std::vector<ReidImage> list_nameless_images(const fs::path& folder, LeftOut* left_out) {
  const auto files = image_files(folder, left_out);
  std::vector<ReidImage> images;
  for (const auto& file : files) images.push_back({file, 0, 0});
  return images;
}

std::vector<ReidImage> list_reid_images(const fs::path& folder, LeftOut* left_out) {
  auto files = image_files(folder, left_out);
  std::vector<ReidImage> images;
  images.reserve(files.size());
  for (auto& file : files) {
    const auto parts = parse_name(file);
    if (!parts) {
      throw std::invalid_argument(file.string() +
                                  ": the name does not say who is on it, expected PID_cCAM... as "
                                  "in 0002_c1s1_000451_03.jpg");
    }
    if (parts->pid < 0) {
      if (left_out != nullptr) ++left_out->junk;
      continue;
    }
    images.push_back({std::move(file), parts->pid, parts->camid});
  }
  return images;
}

bool has_split(const fs::path& root, Split split) {
  return fs::is_directory(root / folder_name(split));
}

fs::path split_folder(const fs::path& root, Split split) {
  if (has_split(root, split)) return root / folder_name(split);
  if (split == Split::train && fs::is_directory(root)) return root;
  throw std::invalid_argument(root.string() + ": has no folder " + folder_name(split));
}

std::vector<ReidImage> list_validation_images(const fs::path& root) {
  std::vector<ReidImage> images;
  if (has_split(root, Split::query) && has_split(root, Split::gallery)) {
    images = list_reid_images(split_folder(root, Split::query));
    auto gallery = list_reid_images(split_folder(root, Split::gallery));
    std::move(gallery.begin(), gallery.end(), std::back_inserter(images));
  } else {
    images = list_reid_images(split_folder(root, Split::train));
  }
  std::erase_if(images, [](const ReidImage& image) { return image.pid == kDistractorPid; });
  return images;
}

}  // namespace sdmt::reid
