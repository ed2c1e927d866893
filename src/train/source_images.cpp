// SPDX-License-Identifier: Apache-2.0
#include "source_images.h"

#include <stdexcept>
#include <utility>

namespace sdmt::train {

std::span<const image::Image> SourceImages::with(std::span<const int> wanted) {
  if (files_.empty()) return images_;
  std::vector<int> missing;
  std::vector<std::filesystem::path> paths;
  for (const int i : wanted) {
    if (images_[i].width > 0) continue;
    missing.push_back(i);
    paths.push_back(files_[i]);
  }
  auto decoded = media::read_images(paths);
  for (std::size_t k = 0; k < missing.size(); ++k) {
    if (!decoded[k]) {
      throw std::runtime_error(paths[k].string() + ": cannot be read, as it could when we began");
    }
    images_[missing[k]] = std::move(*decoded[k]);
  }
  return images_;
}

}  // namespace sdmt::train
