// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "retention.h"
#include "sdmt/pipeline/line_output.h"
#include "sdmt/pipeline/video_output_file.h"

namespace sdmt::pipeline {

/// A video without an end, in pieces NAME.TIME.EXTENSION with the time at which
/// they begin. What is written can be played at any time, also when the program
/// is killed: containers whose index is written last (.mp4, .mov) are refused.
/// While there is little room on the disk nothing is written, which is told.
class VideoSegments : public VideoOutput {
 public:
  /// Pieces are as large or long as `flowing` says, kLongest where it says
  /// nothing. Throws std::invalid_argument as VideoOutputFile, and for a
  /// container that cannot be played before it is whole.
  VideoSegments(const std::string& path, double frame_rate, Flowing flowing);
  ~VideoSegments() override;

  void write(const image::Image& image) override;
  void commit() override;

  static constexpr double kLongest = 600;  ///< seconds

 private:
  bool has_room();
  bool is_old() const;

  std::string path_;
  double frame_rate_;
  Flowing flowing_;
  Retention retention_;
  std::unique_ptr<VideoEncoder> encoder_;
  std::string segment_;
  std::chrono::steady_clock::time_point begun_, looked_;
  bool full_ = false;
  long missing_ = 0;  // frames since then
};

}  // namespace sdmt::pipeline
