// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

namespace sdmt::python {

/// Throws KeyboardInterrupt after Ctrl-C. To be called without the interpreter's lock. Python sees
/// signals in its main thread alone: called by another, nothing happens.
inline void look_for_signals() {
  const pybind11::gil_scoped_acquire held;
  if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
}

}  // namespace sdmt::python
