// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/option_table.h"

namespace sdmt::io {

std::string markdown_row(const std::vector<std::string>& cells) {
  std::string row = "|";
  for (const std::string& cell : cells) row += (cell.empty() ? "" : " " + cell) + " |";
  return row + "\n";
}

}  // namespace sdmt::io
