// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sdmt/image/preprocessing.h"
#include "sdmt/reid/network_description.h"

namespace sdmt::reid {

/// tau_a of the paper (section III-B): two crops show the same person when 1 - d, d their Euclidean
/// distance, exceeds `value`. It holds for one trained network only, so it is stored with it.
struct AffinityThreshold {
  double value = 0.895;  ///< [-1, 1]
  /// How it was chosen on the validation pairs: "accuracy", "fpr", "eer" or "manual".
  std::string criterion = "manual";
  /// Share of different people that pass it on the validation pairs, [0, 1], if known.
  std::optional<double> false_positive_rate;
};

/// What the network was trained on and what it reached.
struct TrainingSummary {
  std::vector<std::string> datasets;     ///< names, no paths
  std::int64_t iterations = 0;           ///< optimiser steps
  std::string loss;                      ///< e.g. "batch-hard contrastive"
  std::map<std::string, double> scores;  ///< e.g. {"validation auc", 0.98}
};

/// How a network was fitted to a scene by the tracks of people in it, after its training.
struct AdaptationSummary {
  std::string start;                     ///< name of the model it began with
  std::vector<std::string> scenes;       ///< names, no paths
  std::string date;                      ///< "2026-11-27 06:01 UTC"
  std::int64_t iterations = 0;           ///< optimiser steps
  std::map<std::string, double> before;  ///< scores on the part held out, e.g. {"auc", 0.93}
  std::map<std::string, double> after;   ///< likewise
};

/// Everything a model file says about its network beside the weights.
struct ModelMetadata {
  static constexpr int kFormatVersion = 1;

  int format_version = kFormatVersion;
  std::string architecture;              ///< name of the network [vgg16's]
  std::vector<LayerDescription> layers;  ///< of the network [vgg16's]
  image::Preprocessing preprocessing;    ///< its height and width are the network's input
  /// Order in which the first Linear's weight in the file reads the feature map: "CHW", as PyTorch
  /// flattens.
  std::string flatten_order = "CHW";
  double margin = 0.2;                          ///< of the contrastive loss; > 0
  std::optional<AffinityThreshold> tau_a;       ///< absent until validated
  std::optional<TrainingSummary> training;      ///< absent for an untrained network
  std::optional<AdaptationSummary> adaptation;  ///< absent for a network that was not adapted
  std::string provenance;                       ///< free text: where the weights come from, licence

  /// Of vgg16, or of another network; all the rest is at its default.
  ModelMetadata();
  explicit ModelMetadata(NetworkDescription network);

  /// The network: architecture, layers, and the input's height and width.
  NetworkDescription network() const;

  /// Throws std::invalid_argument naming the field, its value and the bound.
  void validate() const;
};

/// One JSON object in one line, keys in a fixed order. The layers of vgg16 are left out.
std::string to_json(const ModelMetadata& metadata);

/// Reads what to_json() wrote. Keys it does not know are ignored, so that files of later minor
/// versions open; optional ones may be absent. Throws std::invalid_argument naming `source`, the
/// key and what was expected: for text that is no JSON object, a missing format_version,
/// architecture or preprocessing, a value of the wrong type or range, layers that make no network
/// or are missing (for another architecture than vgg16), another flatten order, a format_version
/// above kFormatVersion.
ModelMetadata parse_model_metadata(std::string_view json, const std::string& source);

}  // namespace sdmt::reid
