// SPDX-License-Identifier: Apache-2.0
#include "module.h"

PYBIND11_MODULE(_sdmt, module) {
  // Users see what is here under the name of the package.
  module.attr("__name__") = "sdmt";
  sdmt::python::add_tracker(module);
  sdmt::python::add_files(module);
  module.attr("__name__") = "sdmt._sdmt";
  module.attr("__version__") = SDMT_VERSION;
}
