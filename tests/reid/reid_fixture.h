// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <nlohmann/json.hpp>

#include "sdmt/reid/labelled_embeddings.h"

namespace sdmt::reid {

/// What tests/parity/reid_fixture.py computed.
inline nlohmann::json read_reid_fixture() {
  std::ifstream file(SDMT_TESTS_DIR "/parity/reid_fixture.json");
  return nlohmann::json::parse(file);
}

inline LabelledEmbeddings labelled(const std::vector<std::vector<float>>& rows,
                                   std::vector<int> pids, std::vector<int> camids) {
  LabelledEmbeddings images;
  images.embeddings.resize(
      {static_cast<int>(rows.size()), 1, 1, static_cast<int>(rows.at(0).size())});
  float* out = images.embeddings.data();
  for (const auto& row : rows) out = std::copy(row.begin(), row.end(), out);
  images.pids = std::move(pids);
  images.camids = std::move(camids);
  return images;
}

inline LabelledEmbeddings fixture_images(const nlohmann::json& fixture) {
  return labelled(fixture["embeddings"].get<std::vector<std::vector<float>>>(),
                  fixture["pids"].get<std::vector<int>>(),
                  fixture["camids"].get<std::vector<int>>());
}

}  // namespace sdmt::reid
