// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "sdmt/image/patch.h"
#include "sdmt/nn/tensor.h"
#include "sdmt/train/augmentation.h"

namespace sdmt::train {

// Pixels each way that an image must have to be looked at.
inline constexpr int kSmallestImage = 2;

// Which of the ways to look at an image: 0 as it is, 1 its mirror image (when flips are allowed),
// 2 and above augmented, each differently.
struct View {
  int image = 0;
  int number = 0;
};

// The network's input for each view of the images: [views, height, width, 3]. By all threads; view
// v of image i is the same in every call.
void make_view_patches(std::span<const image::Image> images, std::span<const View> views,
                       const AugmentationOptions& options, std::uint64_t seed,
                       const image::Preprocessing& preprocessing, nn::Tensor& patches);

// The same for a batch, or the part of one that begins at `first`, augmented anew in each
// iteration.
void make_batch_patches(std::span<const image::Image> images, std::span<const int> batch,
                        std::size_t first, std::int64_t iteration,
                        const AugmentationOptions& options, std::uint64_t seed,
                        const image::Preprocessing& preprocessing, nn::Tensor& patches);

}  // namespace sdmt::train
