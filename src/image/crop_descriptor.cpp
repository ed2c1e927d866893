// SPDX-License-Identifier: Apache-2.0
#include "sdmt/image/crop_descriptor.h"

namespace sdmt::image {

void CropDescriptor::describe_shifted(const ImageView& image, const PixelRect& window,
                                      std::span<const GridShift> shifts, DescriptorRows& out) {
  std::vector<Crop> crops;
  crops.reserve(shifts.size());
  for (const GridShift& shift : shifts) crops.push_back({image, shift.applied_to(window)});
  describe(crops, out);
}

}  // namespace sdmt::image
