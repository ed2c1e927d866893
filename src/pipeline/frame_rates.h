// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace sdmt::pipeline {

/// Frames per second that a video may state; what is beyond is taken as not known.
inline constexpr double kLowestFrameRate = 0.1;
inline constexpr double kHighestFrameRate = 5000;

}  // namespace sdmt::pipeline
