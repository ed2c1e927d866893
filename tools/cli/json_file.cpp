// SPDX-License-Identifier: Apache-2.0
#include "cli/json_file.h"

#include "sdmt/io/output_file.h"

namespace sdmt::tools {

void write_json_file(const std::filesystem::path& path, const nlohmann::ordered_json& json) {
  if (path.empty()) return;
  constexpr int kIndent = 1;
  const auto text =
      json.dump(kIndent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  io::write_text_file(path, text + "\n");
}

}  // namespace sdmt::tools
