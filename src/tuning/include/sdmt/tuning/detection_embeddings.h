// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "sdmt/image/crop_descriptor.h"
#include "sdmt/tuning/tuning_plan.h"

namespace sdmt::tuning {

/// Embeds once what all runs look at: the boxes that a tracker of some setting may ask for, on the
/// sequences' frames, where detections have no embeddings yet. The plan is by appearance from then
/// on, with the base's tau_a or that of `appearance`. `progress` gets the frames done so far and
/// may throw to stop.
///
/// Throws std::invalid_argument for a sequence without frames, a setting with boosting, which looks
/// at frames again, and when there is no tau_a; and what reading and embedding throw.
void embed_detections(TuningPlan& plan, image::CropDescriptor& appearance,
                      const std::function<void(int frames)>& progress);

}  // namespace sdmt::tuning
