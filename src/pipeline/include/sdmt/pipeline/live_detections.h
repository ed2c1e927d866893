// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <istream>
#include <string>
#include <vector>

#include "sdmt/mot/detection_formats.h"
#include "sdmt/pipeline/detection_source.h"
#include "sdmt/track/given_embeddings.h"

namespace sdmt::pipeline {

/// Boxes that come while they are tracked: mot::JsonLineReader's lines, one a frame, in order. For
/// a frame it waits for the line of that frame, or of a later one, and never for more; frames
/// without a line have no boxes. Lines of frames that the input does not have are passed over.
class LiveDetections : public DetectionSource {
 public:
  /// Waits for the first line, which says whether embeddings come with the boxes. `stream` must
  /// outlive it; `name` is for messages.
  LiveDetections(std::istream& stream, std::string name, const mot::DetectionReading& reading);

  /// Throws std::invalid_argument for a line that cannot be understood.
  std::vector<mot::Detection> detect(const Frame& frame) override;
  std::filesystem::path file() const override { return "-"; }
  bool ended() const override { return ended_; }
  std::optional<double> time() const override { return time_; }
  image::CropDescriptor* descriptor() override { return has_embeddings_ ? &embeddings_ : nullptr; }

 private:
  void read_on();

  std::istream& stream_;
  std::string name_;
  mot::JsonLineReader reader_;
  std::size_t line_ = 0;
  mot::JsonLineReader::Frame next_;  // read, of this frame or a later one
  bool ended_ = false;               // there is none
  std::optional<double> time_;       // of the frame detected last
  bool has_embeddings_ = false;
  track::GivenEmbeddings embeddings_;
};

}  // namespace sdmt::pipeline
