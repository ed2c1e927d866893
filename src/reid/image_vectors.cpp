// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/image_vectors.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdmt/reid/embedding_file.h"

namespace sdmt::reid {

namespace {

namespace fs = std::filesystem;

fs::path full_path(const fs::path& path) {
  if (path.empty()) return path;
  fs::path normal = fs::absolute(path).lexically_normal();
  return normal.has_filename() ? normal : normal.parent_path();
}

// "cuhk03/bounding_box_train/0001.jpg" of an image in the data set .../cuhk03.
fs::path known_by(const fs::path& image, const fs::path& root) {
  return full_path(image).lexically_relative(full_path(root).parent_path());
}

std::ptrdiff_t length(const fs::path& path) { return std::distance(path.begin(), path.end()); }

// The last `count` parts of a path, or all of it.
fs::path ending(const fs::path& path, std::ptrdiff_t count) {
  fs::path result;
  for (auto at = std::prev(path.end(), std::min(count, length(path))); at != path.end(); ++at) {
    result /= *at;
  }
  return result;
}

struct Row {
  std::size_t file = 0;
  int row = 0;
  bool unique = true;
};

class Rows {
 public:
  Rows(std::span<const fs::path> files, const std::set<std::ptrdiff_t>& lengths) {
    for (const auto& file : files) {
      files_.push_back(read_embedding_file(file));
      require_same_size(file, files.front());
      const auto& images = files_.back().images;
      for (std::size_t i = 0; i < images.size(); ++i) {
        const fs::path name = full_path(images[i]);
        for (const auto count : lengths) {
          const Row row{files_.size() - 1, static_cast<int>(i), true};
          const auto [entry, added] = rows_.emplace(ending(name, count).string(), row);
          if (!added) entry->second.unique = false;
        }
      }
    }
  }

  int dimensions() const { return files_.front().rows.shape().c; }

  const float* find(const fs::path& name, const fs::path& image, const fs::path& first_file) const {
    const auto found = rows_.find(name.string());
    if (found == rows_.end()) {
      throw std::invalid_argument(first_file.string() + ": has no vector of " + image.string() +
                                  ", expected an image whose path ends in " + name.string());
    }
    if (!found->second.unique) {
      throw std::invalid_argument(first_file.string() + ": has more than one vector of " +
                                  name.string());
    }
    return files_[found->second.file].rows.image(found->second.row);
  }

 private:
  void require_same_size(const fs::path& file, const fs::path& first) const {
    const int size = files_.back().rows.shape().c;
    if (size == dimensions()) return;
    throw std::invalid_argument(file.string() + ": has vectors of " + std::to_string(size) +
                                " values, expected " + std::to_string(dimensions()) + " as in " +
                                first.string());
  }

  std::vector<EmbeddingFile> files_;
  std::map<std::string, Row> rows_;
};

}  // namespace

nn::Tensor image_vectors(std::span<const fs::path> files, std::span<const fs::path> paths,
                         std::span<const fs::path> roots) {
  std::vector<fs::path> names;
  std::map<fs::path, fs::path> owners;  // an image may take part twice, under one path
  std::set<std::ptrdiff_t> lengths;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    names.push_back(known_by(paths[i], roots[i]));
    lengths.insert(length(names.back()));
    const auto [owner, added] = owners.emplace(names.back(), full_path(paths[i]));
    if (!added && owner->second != full_path(paths[i])) {
      throw std::invalid_argument(owner->second.string() + " and " + full_path(paths[i]).string() +
                                  " are both known as " + names.back().string() +
                                  ": rename a data folder");
    }
  }
  const Rows rows(files, lengths);
  nn::Tensor vectors({static_cast<int>(paths.size()), 1, 1, rows.dimensions()});
  for (std::size_t i = 0; i < paths.size(); ++i) {
    std::copy_n(rows.find(names[i], paths[i], files.front()), rows.dimensions(),
                vectors.image(static_cast<int>(i)));
  }
  return vectors;
}

}  // namespace sdmt::reid
