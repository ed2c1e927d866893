// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace sdmt::io {

/// What a file is that was taken for a safetensors file, by its first bytes, as "a zip archive
/// (...)"; empty when they say nothing.
std::string_view foreign_format(std::string_view first_bytes);

}  // namespace sdmt::io
