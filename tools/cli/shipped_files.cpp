// SPDX-License-Identifier: Apache-2.0
#include "cli/shipped_files.h"

#include <fmt/core.h>

#include <cstdlib>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "cli/console.h"

namespace sdmt::tools {

namespace {

namespace fs = std::filesystem;

std::vector<fs::path> share_folders() {
  if (const char* folder = std::getenv("SDMT_SHARE_DIR"); folder != nullptr && *folder != '\0') {
    return {fs::path(folder)};
  }
  std::error_code failed;
  const fs::path binary = fs::read_symlink("/proc/self/exe", failed);
  if (failed) return {};
  const fs::path parent = binary.parent_path().parent_path();
  return {parent / "share" / "sdmt", parent};
}

// The first that is a file; an empty path when none is. `tried` collects the others.
fs::path first_file(const std::vector<fs::path>& candidates, std::string& tried) {
  std::error_code ignored;
  for (const fs::path& candidate : candidates) {
    if (fs::is_regular_file(candidate, ignored)) return candidate;
    tried += (tried.empty() ? "" : ", ") + candidate.string();
  }
  return {};
}

}  // namespace

fs::path find_config_file(const std::string& name) {
  std::vector<fs::path> candidates;
  if (!fs::path(name).has_parent_path()) {
    for (const fs::path& folder : share_folders()) {
      fs::path file = folder / "configs" / name;
      if (file.extension() != ".json") file += ".json";
      candidates.push_back(file);
    }
  }
  std::error_code ignored;
  if (fs::exists(name, ignored) && !fs::is_directory(name, ignored)) return name;
  std::string tried = name;
  fs::path found = first_file(candidates, tried);
  if (found.empty()) {
    throw std::invalid_argument(fmt::format("--config {}: no such file (tried {})", name, tried));
  }
  return found;
}

fs::path find_default_model() {
  std::vector<fs::path> candidates;
  for (const fs::path& folder : share_folders()) {
    candidates.push_back(folder / "models" / "sdmt-lite.safetensors");
  }
  std::string tried;
  fs::path found = first_file(candidates, tried);
  if (found.empty()) {
    throw std::invalid_argument(
        fmt::format("the shipped model was not found (tried {}); name one with --model", tried));
  }
  detail("model {}\n", found.string());
  return found;
}

}  // namespace sdmt::tools
