// SPDX-License-Identifier: Apache-2.0
// NumPy arrays as the tracker's types, and back, without copies where the layout allows.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdmt/image/image_view.h"
#include "sdmt/mot/detection.h"

namespace sdmt::python {

namespace py = pybind11;

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;

/// An object as an array, converted where it must be. Throws std::invalid_argument `NAME is ...,
/// expected an array of numbers`.
template <typename Array>
Array to_array(const py::object& object, const char* name) {
  auto array = Array::ensure(object);
  if (!array) {
    PyErr_Clear();
    throw std::invalid_argument(std::string(name) + " is a " + Py_TYPE(object.ptr())->tp_name +
                                ", expected an array of numbers");
  }
  return array;
}

/// "(3, 4)"
std::string shape_text(const py::array& array);

/// Throws std::invalid_argument `NAME has shape (3, 5), expected EXPECTED` unless it `holds`.
void require_shape(bool holds, const char* name, const py::array& array, const char* expected);

/// [n, 4] left, top, width, height and [n] scores as detections. An empty array of any shape is no
/// boxes; without scores all are 1.
std::vector<mot::Detection> to_detections(const py::object& boxes, const py::object& scores);

/// [n, 4] boxes.
std::vector<mot::Tlwh> to_boxes(const py::object& boxes);

/// An image that is looked at where it lies. uint8 [height, width, 3] whose pixels are next to each
/// other in a row, as cv2 gives it, also cut out of a larger one or with its channels turned round
/// (image[:, :, ::-1]); any other layout is copied once into `owner`, which keeps the pixels.
image::ImageView to_image(const py::object& image, image::ChannelOrder order, py::object& owner);

/// The same array, which can no longer be written to.
py::array make_read_only(py::array array);

/// A column of structs in a row as a read-only array that shares their memory; `owner` keeps it.
/// `first`: of the first struct; nullptr when there is none.
template <typename Value, typename Row>
py::array column(std::span<const Row> rows, const Value* first, py::ssize_t width,
                 const py::object& owner) {
  std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(rows.size())};
  std::vector<py::ssize_t> strides{sizeof(Row)};
  if (width > 1) shape.push_back(width), strides.push_back(sizeof(Value));
  if (first == nullptr) return make_read_only(py::array_t<Value>(shape));
  return make_read_only(py::array_t<Value>(shape, strides, first, owner));
}

}  // namespace sdmt::python
