// SPDX-License-Identifier: Apache-2.0
// In place of network_detector.cpp where OpenCV comes without its dnn module.
#include <stdexcept>

#include "sdmt/pipeline/network_detector.h"

namespace sdmt::pipeline {

void NetworkOptions::validate() const {}

struct NetworkDetector::Network {};

NetworkDetector::NetworkDetector(const NetworkOptions& options) {
  throw std::invalid_argument(
      options.file.string() +
      ": this build cannot run detector networks: OpenCV had no dnn module");
}

NetworkDetector::~NetworkDetector() = default;

std::vector<mot::Detection> NetworkDetector::detect(const Frame&) { return {}; }

std::string NetworkDetector::description() const { return {}; }

}  // namespace sdmt::pipeline
