// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image_codec.h"
#include "live_stream.h"
#include "video_codec.h"

namespace sdmt::tools {

/// What needs OpenCV's codecs or FFmpeg, which bring some 230 libraries along. They are linked to a
/// library of their own, sdmt-codecs.so, which the binary loads when it calls one of these the
/// first time.
struct Codecs {
  const char* version;  ///< of the binary that it belongs to
  decltype(&media::decode_pixels) decode_pixels;
  decltype(&media::encode_pixels) encode_pixels;
  decltype(&pipeline::capture_with_ffmpeg) capture_with_ffmpeg;
  decltype(&pipeline::capture_camera) capture_camera;
  decltype(&pipeline::write_with_ffmpeg) write_with_ffmpeg;
  decltype(&pipeline::open_live_stream) open_live_stream;
  decltype(&pipeline::open_piped_stream) open_piped_stream;
};

}  // namespace sdmt::tools

/// All that the library exports.
extern "C" __attribute__((visibility("default"))) const sdmt::tools::Codecs* sdmt_codecs();
