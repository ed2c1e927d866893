// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/image/image.h"
#include "sdmt/track/finished_frame.h"

namespace sdmt::pipeline {

/// Makes everybody in a finished frame unrecognisable, also where the detector missed them between
/// two boxes: the box and a tenth of its size on all sides is replaced by a mosaic of about 8 tiles
/// across, so that nothing finer than that is left in the pixels.
void blur_people(const track::FinishedFrame& frame, image::Image& image);

}  // namespace sdmt::pipeline
