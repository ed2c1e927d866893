// SPDX-License-Identifier: Apache-2.0
#include "codecs/codecs.h"

const sdmt::tools::Codecs* sdmt_codecs() {
  using namespace sdmt;
  static const tools::Codecs codecs{SDMT_VERSION,
                                    media::decode_pixels,
                                    media::encode_pixels,
                                    pipeline::capture_with_ffmpeg,
                                    pipeline::capture_camera,
                                    pipeline::write_with_ffmpeg,
                                    pipeline::open_live_stream,
                                    pipeline::open_piped_stream};
  return &codecs;
}
