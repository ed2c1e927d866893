// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/camera_means.h"

#include <cmath>
#include <cstddef>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace sdmt::reid {

namespace {

struct Mean {
  std::vector<double> sum;
  int rows = 0;
};

}  // namespace

void subtract_camera_means(nn::Tensor& embeddings, std::span<const int> camids) {
  const int rows = embeddings.shape().n;
  const std::size_t size = embeddings.shape().image_size();
  if (camids.size() != static_cast<std::size_t>(rows)) {
    throw std::invalid_argument("camera means: " + std::to_string(rows) + " rows with " +
                                std::to_string(camids.size()) + " camids, expected one each");
  }
  std::map<int, Mean> means;
  for (int i = 0; i < rows; ++i) {
    Mean& mean = means[camids[i]];
    mean.sum.resize(size);
    for (std::size_t k = 0; k < size; ++k) mean.sum[k] += embeddings.image(i)[k];
    ++mean.rows;
  }
  for (const auto& [camera, mean] : means) {
    if (mean.rows >= 2) continue;
    throw std::invalid_argument(
        "camera means: camera " + std::to_string(camera) +
        " has 1 image, expected at least 2, better those of dozens of people");
  }
  for (int i = 0; i < rows; ++i) {
    const Mean& mean = means[camids[i]];
    float* row = embeddings.image(i);
    double square = 0;
    for (std::size_t k = 0; k < size; ++k) {
      row[k] -= static_cast<float>(mean.sum[k] / mean.rows);
      square += static_cast<double>(row[k]) * row[k];
    }
    if (square == 0) continue;  // as all others of its camera
    const double length = std::sqrt(square);
    for (std::size_t k = 0; k < size; ++k) row[k] = static_cast<float>(row[k] / length);
  }
}

}  // namespace sdmt::reid
