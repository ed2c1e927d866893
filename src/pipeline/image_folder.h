// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "sdmt/pipeline/frame_source.h"

namespace sdmt::pipeline {

/// A folder of images in natural order. Throws std::invalid_argument when it holds none.
std::unique_ptr<FrameSource> open_image_folder(const std::string& folder);

/// A MOTChallenge sequence; without its images, frames are empty. Throws as mot::Sequence::read(),
/// and when there is no telling how many frames it has.
std::unique_ptr<FrameSource> open_mot_sequence(const std::string& folder);

}  // namespace sdmt::pipeline
