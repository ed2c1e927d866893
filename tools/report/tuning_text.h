// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sdmt/tuning/tuning_result.h"

namespace sdmt::tools {

/// What was found, as tables for the terminal: the scores, what each option is worth, and the
/// sequences.
std::string tuning_text(const tuning::TuningResult& result);

}  // namespace sdmt::tools
