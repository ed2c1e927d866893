// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "validation/validation.h"

namespace sdmt::tools {

/// Of each data set ROC curves on a linear and a logarithmic axis, the two distance histograms with
/// tau_a, and what each tau_a would give: one SVG document.
std::string validation_plot(std::span<const ValidationScores> sets);

/// The plots, the numbers and the hardest mistakes of the model as image pairs in one HTML page.
/// `model` and `described`, one for each set, are what was scored. Throws std::invalid_argument
/// when an image has gone since.
std::string validation_report(std::span<const ValidationScores> sets,
                              std::span<const DescribedCrops> described, const std::string& model);

}  // namespace sdmt::tools
