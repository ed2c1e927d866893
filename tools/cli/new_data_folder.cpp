// SPDX-License-Identifier: Apache-2.0
#include "cli/new_data_folder.h"

#include <fmt/core.h>

#include <stdexcept>
#include <system_error>

namespace sdmt::tools {

namespace fs = std::filesystem;

NewDataFolder::NewDataFolder(const fs::path& folder, const std::vector<std::string>& subfolders) {
  std::error_code failed;
  if (fs::exists(folder, failed) && !fs::is_empty(folder, failed)) {
    throw std::invalid_argument(
        fmt::format("{}: is not empty, expected a new or empty folder", folder.string()));
  }
  for (const std::string& name : subfolders) {
    fs::create_directories(folder / name, failed);
    if (failed) {
      throw std::invalid_argument(
          fmt::format("{}: cannot be made: {}", (folder / name).string(), failed.message()));
    }
    made_.push_back(folder / name);
  }
}

NewDataFolder::~NewDataFolder() {
  std::error_code ignored;
  for (const fs::path& subfolder : made_) fs::remove_all(subfolder, ignored);
}

}  // namespace sdmt::tools
