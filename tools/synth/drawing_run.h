// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

namespace sdmt::tools {

/// Gets the number of pictures that are done; false asks to stop.
using DrawingProgress = std::function<bool(int)>;

/// What the commands that draw data sets have in common: shows the progress of `draw` over `total`
/// pictures, called `unit`, lets a signal stop it, and then says `summary`, or that nothing was
/// written. `draw` returns whether the set is whole.
void run_drawing(int total, const std::string& unit, const std::string& summary,
                 const std::function<bool(const DrawingProgress&)>& draw);

}  // namespace sdmt::tools
