// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/appearance_model.h"

namespace sdmt::track {

void AppearanceModel::embed_shifted(const image::ImageView& frame, const mot::Tlwh& box,
                                    std::span<const BoxShift> shifts, Embeddings& out) {
  std::vector<mot::Tlwh> boxes;
  for (const BoxShift& shift : shifts) boxes.push_back(shift.applied_to(box));
  embed(frame, boxes, out);
}

}  // namespace sdmt::track
