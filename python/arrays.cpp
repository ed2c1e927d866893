// SPDX-License-Identifier: Apache-2.0
#include "arrays.h"

#include <cstdint>

namespace sdmt::python {

std::string shape_text(const py::array& array) {
  std::string text = "(";
  for (py::ssize_t i = 0; i < array.ndim(); ++i) {
    text += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
  }
  return text + (array.ndim() == 1 ? ",)" : ")");
}

void require_shape(bool holds, const char* name, const py::array& array, const char* expected) {
  if (holds) return;
  throw std::invalid_argument(std::string(name) + " has shape " + shape_text(array) +
                              ", expected " + expected);
}

std::vector<mot::Tlwh> to_boxes(const py::object& object) {
  const auto boxes = to_array<Doubles>(object, "boxes");
  std::vector<mot::Tlwh> rows;
  if (boxes.size() == 0) return rows;
  require_shape(boxes.ndim() == 2 && boxes.shape(1) == 4, "boxes", boxes,
                "(n, 4): left, top, width, height");
  const auto values = boxes.unchecked<2>();
  rows.reserve(static_cast<std::size_t>(values.shape(0)));
  for (py::ssize_t i = 0; i < values.shape(0); ++i) {
    rows.push_back({values(i, 0), values(i, 1), values(i, 2), values(i, 3)});
  }
  return rows;
}

std::vector<mot::Detection> to_detections(const py::object& boxes, const py::object& scores) {
  std::vector<mot::Detection> detections;
  for (const mot::Tlwh& box : to_boxes(boxes)) detections.push_back({box, 1.0});
  if (scores.is_none()) return detections;
  const auto values = to_array<Doubles>(scores, "scores");
  require_shape(values.ndim() <= 2 && static_cast<std::size_t>(values.size()) == detections.size(),
                "scores", values,
                ("(" + std::to_string(detections.size()) + ",), one for each box").c_str());
  for (std::size_t i = 0; i < detections.size(); ++i) detections[i].score = values.data()[i];
  return detections;
}

image::ImageView to_image(const py::object& image, image::ChannelOrder order, py::object& owner) {
  auto array = py::array::ensure(image);
  if (!array) PyErr_Clear();
  if (!array || !array.dtype().is(py::dtype::of<std::uint8_t>()) || array.ndim() != 3 ||
      array.shape(2) != 3 || array.size() == 0) {
    throw std::invalid_argument(
        "image is " +
        (array ? py::str(array.dtype()).cast<std::string>() + " " + shape_text(array)
               : std::string("no array")) +
        ", expected uint8 (height, width, 3)");
  }
  const bool in_rows =
      array.strides(0) >= 3 * array.shape(1) && (array.strides(1) == 3 || array.shape(1) == 1);
  const bool turned = in_rows && array.strides(2) == -1;
  if (!turned && !(in_rows && array.strides(2) == 1)) {
    array = py::array_t<std::uint8_t, py::array::c_style>::ensure(array);
  }
  owner = array;
  const auto* data = static_cast<const std::uint8_t*>(array.data());
  if (turned) {
    data -= 2;
    order = order == image::ChannelOrder::bgr ? image::ChannelOrder::rgb : image::ChannelOrder::bgr;
  }
  return {data, static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)),
          array.strides(0), order};
}

py::array make_read_only(py::array array) {
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

}  // namespace sdmt::python
