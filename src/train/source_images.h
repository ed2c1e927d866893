// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "sdmt/media/image_file.h"

namespace sdmt::train {

// Images of a training set, and the files of those that this process has not read yet because
// others have.
class SourceImages {
 public:
  // Both must outlive this object.
  SourceImages(std::vector<image::Image>& images, const std::vector<std::filesystem::path>& files)
      : images_(images), files_(files) {}

  std::size_t size() const { return images_.size(); }
  // All of them, of which the wanted ones have been read. Throws std::runtime_error naming a file
  // that cannot be read any more.
  std::span<const image::Image> with(std::span<const int> wanted);

 private:
  std::vector<image::Image>& images_;
  const std::vector<std::filesystem::path>& files_;
};

}  // namespace sdmt::train
