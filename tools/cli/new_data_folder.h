// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sdmt::tools {

/// A data set in the making: appears whole or not at all, as output files do. Its files go into
/// subfolders; without keep() these are removed again with all they hold.
class NewDataFolder {
 public:
  /// Makes `folder`, unless it is there and empty, and the subfolders. Throws std::invalid_argument
  /// when it is not empty or cannot be made.
  NewDataFolder(const std::filesystem::path& folder, const std::vector<std::string>& subfolders);
  ~NewDataFolder();
  NewDataFolder(const NewDataFolder&) = delete;
  NewDataFolder& operator=(const NewDataFolder&) = delete;

  void keep() { made_.clear(); }

 private:
  std::vector<std::filesystem::path> made_;
};

}  // namespace sdmt::tools
