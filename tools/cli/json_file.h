// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace sdmt::tools {

/// Writes what a command's --json asks for; nothing for an empty path. Bytes that are not UTF-8 (in
/// the name of a folder, say) become U+FFFD. Throws as io::OutputFile.
void write_json_file(const std::filesystem::path& path, const nlohmann::ordered_json& json);

}  // namespace sdmt::tools
