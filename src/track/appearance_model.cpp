// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/appearance_model.h"

namespace sdmt::track {

void AppearanceModel::embed_shifted(const nn::ImageView& frame, const Tlwh& box,
                                    std::span<const BoxShift> shifts, Embeddings& out) {
  std::vector<Tlwh> boxes;
  for (const BoxShift& shift : shifts) boxes.push_back(shift.applied_to(box));
  embed(frame, boxes, out);
}

}  // namespace sdmt::track
