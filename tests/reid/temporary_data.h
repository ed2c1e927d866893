// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "sdmt/image/image.h"
#include "sdmt/nn/random.h"

namespace sdmt::reid {

/// A folder for made-up images that is removed with all it holds when it goes.
class TemporaryData {
 public:
  TemporaryData() {
    static std::atomic<int> serial{0};
    path_ = std::filesystem::temp_directory_path() /
            ("sdmt-data-" + std::to_string(::getpid()) + "-" + std::to_string(++serial));
    std::filesystem::create_directories(path_);
  }
  ~TemporaryData() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryData(const TemporaryData&) = delete;
  TemporaryData& operator=(const TemporaryData&) = delete;

  const std::filesystem::path& path() const { return path_; }

  void write(const std::string& name, const std::string& bytes) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << bytes;
  }
  void touch(const std::string& name) const { write(name, ""); }

  /// A binary PPM file under an image's name: the decoder goes by the contents.
  void write_image(const std::string& name, const image::Image& image) const {
    std::string bytes =
        "P6 " + std::to_string(image.width) + " " + std::to_string(image.height) + " 255\n";
    for (std::size_t i = 0; i < image.bgr.size(); i += 3) {
      for (const std::size_t channel : {2, 1, 0}) {
        bytes += static_cast<char>(image.bgr[i + channel]);
      }
    }
    write(name, bytes);
  }

  /// `images` pictures of each of `people`, whose colours say who they are.
  void write_people(int people, int images, const std::string& folder = ".") const {
    nn::Random random(static_cast<std::uint64_t>(people * 100 + images));
    for (int pid = 1; pid <= people; ++pid) {
      unsigned char colours[2][3];
      for (auto& colour : colours) {
        for (auto& channel : colour) channel = static_cast<unsigned char>(random.below(200));
      }
      for (int k = 0; k < images; ++k) {
        image::Image image(16, 32);
        for (int y = 0; y < image.height; ++y) {
          for (int x = 0; x < image.width; ++x) {
            for (int c = 0; c < 3; ++c) {
              image.pixel(x, y)[c] = static_cast<std::uint8_t>(
                  colours[y < image.height / 2 ? 0 : 1][c] + random.below(50));
            }
          }
        }
        char name[64];
        std::snprintf(name, sizeof name, "%04d_c%ds1_%06d_00.png", pid, 1 + k % 2, k);
        write_image(folder + "/" + name, image);
      }
    }
  }

 private:
  std::filesystem::path path_;
};

}  // namespace sdmt::reid
