// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

namespace sdmt::train {

/// What a file was made with, setting by setting, so that a file that does not belong to the
/// present run is refused with the name of the setting that differs.
using Configuration = std::map<std::string, std::string>;

/// Throws std::invalid_argument naming file, setting and both values when they differ.
void require_same_configuration(const std::string& file, const Configuration& stored,
                                const Configuration& present);

/// The shortest text that reads back as the same number.
std::string to_text(double value);

}  // namespace sdmt::train
