// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace sdmt::io {

/// Levels of lists and objects within each other that check_json() accepts: far beyond any file of
/// ours, far below what would exhaust the stack of a program that goes through them.
inline constexpr int kDeepestJson = 16;

/// Everything that is wrong with a JSON text from a stranger, before a parser is let loose on it:
/// throws std::invalid_argument, beginning with `name`, when `text` is not valid JSON, holds a
/// number beyond what a double holds, is nested deeper than kDeepestJson or names a key twice in
/// one object (of which parsers silently keep the last).
void check_json(std::string_view text, const std::string& name);

}  // namespace sdmt::io
