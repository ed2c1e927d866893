// SPDX-License-Identifier: Apache-2.0
#include "patches.h"

#include <stdexcept>
#include <string>

#include "random_stream.h"
#include "sdmt/io/first_error.h"

namespace sdmt::train {

namespace {

// Exceptions must not leave a parallel region: sizes are checked before it. The files of a training
// set were checked by name when they were read.
void require_visible(const image::Image& image) {
  if (image.width >= kSmallestImage && image.height >= kSmallestImage) return;
  throw std::invalid_argument("an image of " + std::to_string(image.width) + "x" +
                              std::to_string(image.height) +
                              " pixels is too small, expected at least 2x2");
}

void extract(const image::Image& image, const image::Preprocessing& preprocessing, float* out) {
  image::extract_patch(image.view(), {0, 0, 1.0 * image.width, 1.0 * image.height}, preprocessing,
                       out);
}

template <typename MakePatch>
void for_each_patch(std::size_t count, const image::Preprocessing& preprocessing,
                    nn::Tensor& patches, MakePatch make) {
  patches.resize({static_cast<int>(count), preprocessing.height, preprocessing.width, 3});
  io::FirstError error;
#pragma omp parallel for schedule(dynamic)
  for (int i = 0; i < static_cast<int>(count); ++i) {
    error.guard([&] { make(i, patches.image(i)); });
  }
  error.rethrow();
}

}  // namespace

void make_view_patches(std::span<const image::Image> images, std::span<const View> views,
                       const AugmentationOptions& options, std::uint64_t seed,
                       const image::Preprocessing& preprocessing, nn::Tensor& patches) {
  for (const View& view : views) require_visible(images[view.image]);
  for_each_patch(views.size(), preprocessing, patches, [&](std::size_t i, float* out) {
    const View& view = views[i];
    const image::Image& image = images[view.image];
    if (view.number == 0) {
      extract(image, preprocessing, out);
    } else if (view.number == 1 && options.flip > 0) {
      extract(flipped(image), preprocessing, out);
    } else {
      auto random = random_stream(seed, Purpose::view, static_cast<std::uint64_t>(view.number),
                                  static_cast<std::uint64_t>(view.image));
      extract(augment(image, preprocessing.width, preprocessing.height, options, random),
              preprocessing, out);
    }
  });
}

void make_batch_patches(std::span<const image::Image> images, std::span<const int> batch,
                        std::size_t first, std::int64_t iteration,
                        const AugmentationOptions& options, std::uint64_t seed,
                        const image::Preprocessing& preprocessing, nn::Tensor& patches) {
  for (const int image : batch) require_visible(images[image]);
  for_each_patch(batch.size(), preprocessing, patches, [&](std::size_t i, float* out) {
    auto random = random_stream(seed, Purpose::augmentation, first + i,
                                static_cast<std::uint64_t>(iteration));
    const image::Image& image = images[batch[i]];
    extract(augment(image, preprocessing.width, preprocessing.height, options, random),
            preprocessing, out);
  });
}

}  // namespace sdmt::train
