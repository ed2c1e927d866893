// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include "mqtt/publisher.h"
#include "sdmt/pipeline/track_writers.h"

namespace sdmt::tools {

/// Finished frames as messages: a writer beside those of files.
class MessageWriter : public pipeline::TrackWriter {
 public:
  /// `source` as for pipeline::finished_frame_line(). `publisher` must outlive it.
  MessageWriter(Publisher& publisher, std::string camera, std::string source)
      : publisher_(publisher), camera_(std::move(camera)), source_(std::move(source)) {}

  void write(const track::FinishedFrame& frame, const pipeline::FrameTime& time) override {
    publisher_.send_frame(camera_, pipeline::finished_frame_line(source_, frame, time));
  }
  void commit() override {}

 private:
  Publisher& publisher_;
  std::string camera_, source_;
};

}  // namespace sdmt::tools
