// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/media/image_file.h"
#include "sdmt/nn/random.h"

namespace sdmt::train {

/// Random changes of a crop that leave the person who it is. Each stands for something that differs
/// between cameras: probabilities in [0, 1], strengths >= 0; 0 switches a change off. Ranges are in
/// trainer_option_table().
struct AugmentationOptions {
  double flip = 0.5;            ///< probability of a mirror image
  double translate = 0.06;      ///< shift of the box, fraction of its size, each way, < 0.5
  double scale = 0.10;          ///< width and height of the box each times 1 +- this, < 0.5
  double brightness = 0.30;     ///< all channels times 1/(1+b) .. 1+b
  double contrast = 0.20;       ///< distance to middle grey times 1 +- this, <= 1
  double tint = 0.08;           ///< each channel times 1 +- this, <= 1
  double saturation = 0.0;      ///< distance to grey times 1 +- this, <= 1
  double grey = 0.0;            ///< probability of losing all colour
  double low_resolution = 0.3;  ///< probability of shrinking to 0.35 .. 0.8 and back
  double blur = 0.0;            ///< probability of a Gaussian blur, sigma 0.5 .. 1.5 pixels
  double erase = 0.3;   ///< probability of a rectangle of mean colour, 0.1-0.35 x 0.2-0.6 of the
                        ///< crop (random erasing, Zhong et al., AAAI 2020)
  double crop = 0.0;    ///< probability of losing up to a third of the height, above or below
  double gamma = 0.0;   ///< values of 0..1 to the power of 1/(1+g) .. 1+g, <= 10
  double offset = 0.0;  ///< all channels plus up to this fraction of their range, each way, <= 1
  double grey_patch = 0.0;  ///< probability of a rectangle without colour, as large as with erase
                            ///< (local grayscale patches, Gong et al., 2021)
  double noise = 0.0;       ///< standard deviation of the noise of each value is 0 .. this, of 255

  bool operator==(const AugmentationOptions&) const = default;
};

/// A changed copy of `image`, `width` x `height` pixels, sampled bilinearly; what a shifted box
/// sees beyond the image repeats its edge. Depends on `random` only.
image::Image augment(const image::Image& image, int width, int height,
                     const AugmentationOptions& options, nn::Random& random);

/// The mirror image.
image::Image flipped(const image::Image& image);

}  // namespace sdmt::train
