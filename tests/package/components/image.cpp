// SPDX-License-Identifier: Apache-2.0
#include <sdmt/image/image.h>
#include <sdmt/image/patch.h>

#include <cstdio>

int main() {
  const sdmt::image::Image image(40, 30);
  const auto region = sdmt::image::visible_region(image.width, image.height, {30, -5, 20, 20});
  std::printf("%d x %d pixels\n", region->width(), region->height());
}
