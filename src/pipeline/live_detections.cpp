// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/live_detections.h"

#include <string_view>
#include <utility>

namespace sdmt::pipeline {

LiveDetections::LiveDetections(std::istream& stream, std::string name,
                               const mot::DetectionReading& reading)
    : stream_(stream), name_(std::move(name)), reader_(name_, reading) {
  read_on();
  has_embeddings_ = reader_.has_embeddings();
}

void LiveDetections::read_on() {
  constexpr std::string_view kBlank = " \t\r\n";
  std::string text;
  while (std::getline(stream_, text)) {
    ++line_;
    if (text.find_first_not_of(kBlank) == std::string::npos) continue;
    next_ = reader_.read(text, line_);
    return;
  }
  ended_ = true;
}

std::vector<mot::Detection> LiveDetections::detect(const Frame& frame) {
  while (!ended_ && next_.number < frame.number) read_on();
  time_.reset();
  if (ended_ || next_.number != frame.number) return {};
  time_ = next_.time;
  if (has_embeddings_) embeddings_.set(next_.detections, next_.embeddings);
  return next_.detections;
}

}  // namespace sdmt::pipeline
