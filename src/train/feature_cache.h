// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "patches.h"
#include "sdmt/io/safetensors.h"
#include "sdmt/nn/process_group.h"
#include "sdmt/train/configuration.h"
#include "source_images.h"
#include "trained_network.h"

namespace sdmt::train {

// Called with how many views are done and how many there are; may throw to stop.
using CacheProgress = std::function<void(std::int64_t done, std::int64_t total)>;

// Results of the frozen front for `views` views of every image, as float16 (half the memory; the
// rounding is far below what one augmentation changes). Kept in memory, or in a file that can
// serve later runs.
class FeatureCache {
 public:
  struct Source {
    SourceImages& images;
    int views = 1;
    AugmentationOptions augmentation;
    std::uint64_t seed = 0;
    image::Preprocessing preprocessing;
  };

  // In memory, or in the safetensors file `path`, which is computed when it does not exist, and
  // which all processes of the group see. Each of them computes a share. Throws
  // std::invalid_argument naming the setting when it was made with another configuration.
  FeatureCache(TrainedNetwork& network, const Source& source, nn::ProcessGroup& group,
               const CacheProgress& progress, const std::filesystem::path& path = {},
               const Configuration& configuration = {});

  static std::size_t bytes(TrainedNetwork& network, std::size_t images, int views);

  // front_shape(1).size() values.
  void read(View view, float* out) const;

 private:
  std::size_t values_;  // of one view
  std::size_t images_;
  std::vector<std::uint16_t> memory_;
  std::optional<io::Safetensors> file_;
  const io::SafetensorsEntry* stored_ = nullptr;  // in file_
};

}  // namespace sdmt::train
