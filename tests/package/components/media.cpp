// SPDX-License-Identifier: Apache-2.0
#include <sdmt/media/image_file.h>

#include <cstdio>

int main() {
  const auto bytes = sdmt::media::encode_jpeg(sdmt::image::Image(40, 30), 90);
  std::printf("%d pixels wide\n", sdmt::media::decode_image(bytes).width);
}
