// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace sdmt::tests {

/// Writes a Darknet detector of 64 x 64 pixels whose boxes can be foretold: wherever a block of
/// 8 x 8 pixels is red (255, 0, 0) it sees a "person", wherever one is blue a "car", 8 pixels wide
/// and 24 tall around the block's centre, with a score near 1; nothing where it is grey. Leaves
/// folder/made.cfg, .weights and .names, returns the first.
std::filesystem::path make_darknet(const std::filesystem::path& folder);

/// Writes a Darknet detector of 256 x 256 pixels that can only run where both sides of its input
/// are multiples of 64: it fails at the first picture that is not square. Returns
/// folder/fragile.cfg.
std::filesystem::path make_fragile_darknet(const std::filesystem::path& folder);

/// The bytes of an ONNX network that is one convolution, of 8 x 8 pixels to one of `channels`
/// values: [1, 3, 64, 64] to [1, channels, 8, 8].
std::string make_onnx(int channels);

}  // namespace sdmt::tests
