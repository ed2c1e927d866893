// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "sdmt/pipeline/frame_source.h"

namespace sdmt::pipeline {

/// A video file. Throws std::invalid_argument when FFmpeg cannot decode it, or it is a text or a
/// single picture, which FFmpeg would play as well.
std::unique_ptr<FrameSource> open_video_file(const std::string& file);

/// A stream's URL. Throws std::runtime_error when it does not answer.
std::unique_ptr<FrameSource> open_stream(const std::string& url);

/// "camera:N". Throws std::invalid_argument for another N than 0 to 999, std::runtime_error when
/// there is no such camera.
std::unique_ptr<FrameSource> open_camera(const std::string& input);

}  // namespace sdmt::pipeline
