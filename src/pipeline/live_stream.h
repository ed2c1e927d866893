// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "sdmt/pipeline/frame_source.h"

namespace sdmt::pipeline {

/// A stream read by FFmpeg itself, which can be told to stop while a server is silent, and says
/// which frames came garbled. next() gives up `timeout` seconds after the frame before, and as soon
/// as `stopped` says so. Throws std::runtime_error when the stream does not answer or holds no
/// video.
std::unique_ptr<FrameSource> open_live_stream(const std::string& url, double timeout,
                                              std::function<bool()> stopped);

/// The same for a video that comes by standard input, which has an end. Nothing of it is lost, and
/// whoever sends it may take its time.
std::unique_ptr<FrameSource> open_piped_stream(std::function<bool()> stopped);

}  // namespace sdmt::pipeline
