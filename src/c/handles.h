// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "sdmt.h"
#include "sdmt/image/image_view.h"
#include "sdmt/mot/box.h"
#include "sdmt/reid/model_file.h"

struct sdmt_model {
  std::shared_ptr<const sdmt::reid::Model> model;
};

namespace sdmt::c {

/// Throws std::invalid_argument naming the field.
inline image::ImageView to_view(const sdmt_image& image) {
  const auto refuse = [](const char* field, long long value, const std::string& expected) {
    throw std::invalid_argument("image: " + std::string(field) + " is " + std::to_string(value) +
                                ", expected " + expected);
  };
  if (image.data == nullptr) throw std::invalid_argument("image: data is NULL");
  if (image.width < 1) refuse("width", image.width, "1 or more pixels");
  if (image.height < 1) refuse("height", image.height, "1 or more pixels");
  if (image.stride / 3 < image.width) refuse("stride", image.stride, "3 * width bytes or more");
  if (image.order != SDMT_BGR && image.order != SDMT_RGB) {
    refuse("order", image.order, "SDMT_BGR or SDMT_RGB");
  }
  return {image.data, image.width, image.height, image.stride,
          image.order == SDMT_RGB ? image::ChannelOrder::rgb : image::ChannelOrder::bgr};
}

inline mot::Tlwh to_tlwh(const sdmt_box& box) { return {box.left, box.top, box.width, box.height}; }
inline sdmt_box to_c(const mot::Tlwh& box) { return {box.left, box.top, box.width, box.height}; }

}  // namespace sdmt::c
