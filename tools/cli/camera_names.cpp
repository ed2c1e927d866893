// SPDX-License-Identifier: Apache-2.0
#include "cli/camera_names.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <set>

#include "sdmt/pipeline/frame_source.h"

namespace sdmt::tools {

namespace {

std::string name_of(const std::string& input) {
  std::string name;
  if (pipeline::is_live(input)) {
    name = pipeline::display_name(input);
    if (const auto scheme = name.find("://"); scheme != std::string::npos) {
      name = name.substr(scheme + 3);
      name = name.substr(0, name.find_first_of("?#"));
      if (name.starts_with("***@")) name = name.substr(4);
    }
  } else {
    const auto path = std::filesystem::path(input).lexically_normal();
    const auto last = path.has_filename() ? path : path.parent_path();
    name = std::filesystem::is_directory(last) ? last.filename() : last.stem();
  }
  std::replace_if(
      name.begin(), name.end(),
      [](unsigned char c) { return std::isalnum(c) == 0 && c != '.' && c != '_' && c != '-'; },
      '-');
  name.erase(0, name.find_first_not_of(".-"));
  while (name.ends_with('-')) name.pop_back();
  return name.empty() ? "camera" : name;
}

}  // namespace

std::vector<std::string> camera_names(const std::vector<std::string>& inputs) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const std::string& input : inputs) {
    const std::string name = name_of(input);
    std::string distinct = name;
    for (int n = 2; !taken.insert(distinct).second; ++n) distinct = name + "-" + std::to_string(n);
    names.push_back(distinct);
  }
  return names;
}

}  // namespace sdmt::tools
