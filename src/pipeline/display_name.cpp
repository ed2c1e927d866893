// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "sdmt/pipeline/frame_source.h"

namespace sdmt::pipeline {

std::string display_name(const std::string& input) {
  const auto scheme = input.find("://");
  if (scheme == std::string::npos) return input;
  std::string name = input;
  // A password may hold any character, so the last @ ends it.
  const auto user = scheme + 3;
  if (const auto at = name.rfind('@'); at != std::string::npos && at >= user) {
    name.replace(user, at - user, "***");
  }
  if (const auto query = name.find_first_of("?#", scheme); query != std::string::npos) {
    name.replace(query + 1, std::string::npos, "***");
  }
  return name;
}

}  // namespace sdmt::pipeline
