// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "sdmt/nn/tensor.h"

namespace sdmt::reid {

/// Takes from each row of `embeddings` {n,1,1,d}, of length 1, the mean of the rows of its camera,
/// and scales what is left to length 1 again. What the vectors of one camera have in common is its
/// light and background: less that, people are told apart better where the network was not trained,
/// and across cameras (docs/validation.md has what it brings). Needs nobody's name, but dozens of
/// people of each camera: the mean of a few is who they are. A threshold for the vectors as they
/// were does not hold for these. Camera-wise means are the test-time part of Zhuang et al.,
/// Rethinking the distribution gap of person re-identification with camera-based batch
/// normalization, ECCV 2020.
///
/// camids[i] is the camera of row i. Throws std::invalid_argument when there are not as many as
/// rows, or naming a camera with less than two images.
void subtract_camera_means(nn::Tensor& embeddings, std::span<const int> camids);

}  // namespace sdmt::reid
