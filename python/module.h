// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

namespace sdmt::python {

/// Model, Embedder, Tracker, FinishedFrame.
void add_tracker(pybind11::module_& module);
/// Readers and writers of files, evaluation, validation.
void add_files(pybind11::module_& module);

}  // namespace sdmt::python
