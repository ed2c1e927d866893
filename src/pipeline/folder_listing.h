// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sdmt::pipeline {

struct ImageListing {
  std::vector<std::filesystem::path> images;  ///< in natural order: 2.jpg before 10.jpg
  /// What else is there, counted by reason ("2 hidden files and 1 folder are left out"); empty when
  /// there is nothing else.
  std::string left_out;
};

/// The images of a folder by their names' extensions, links that lead nowhere among them: they keep
/// the place of a frame. Left out are hidden files (names beginning with a dot, as macOS makes them
/// beside every file), folders, and files of other kinds. Throws std::invalid_argument when the
/// folder cannot be read.
ImageListing list_images(const std::filesystem::path& folder);

}  // namespace sdmt::pipeline
