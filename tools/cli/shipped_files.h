// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace sdmt::tools {

/// What ships beside the binary (the folders configs/ and models/) is looked for in the folder that
/// the environment variable SDMT_SHARE_DIR names; when it is not set, in ../share/sdmt and in ..
/// seen from the folder of the running binary: the installed tree and a build folder of the
/// sources.

/// A file as it is named, or a shipped configuration: "track-paper" and "track-paper.json" both
/// find configs/track-paper.json. Throws std::invalid_argument naming what was tried.
std::filesystem::path find_config_file(const std::string& name);

/// models/sdmt-lite.safetensors. Throws std::invalid_argument naming what was tried.
std::filesystem::path find_default_model();

}  // namespace sdmt::tools
