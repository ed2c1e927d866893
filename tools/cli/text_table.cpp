// SPDX-License-Identifier: Apache-2.0
#include "cli/text_table.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace sdmt::tools {

TextTable::TextTable(std::vector<std::string> header, std::set<std::size_t> text_columns)
    : text_columns_(std::move(text_columns)) {
  text_columns_.insert(0);
  rows_.push_back(std::move(header));
}

void TextTable::add_row(std::vector<std::string> cells) {
  if (cells.size() != rows_.front().size()) throw std::logic_error("table row: wrong cell count");
  rows_.push_back(std::move(cells));
}

void TextTable::add_rule() { rows_.emplace_back(); }

std::string TextTable::str() const {
  std::vector<std::size_t> widths(rows_.front().size(), 0);
  std::size_t total = 0;
  for (std::size_t column = 0; column < widths.size(); ++column) {
    for (const auto& row : rows_) {
      if (!row.empty()) widths[column] = std::max(widths[column], row[column].size());
    }
    total += widths[column] + (column == 0 ? 0 : 2);
  }
  std::string text;
  for (const auto& row : rows_) {
    if (row.empty()) {
      text += std::string(total, '-') + "\n";
      continue;
    }
    std::string line;
    for (std::size_t column = 0; column < widths.size(); ++column) {
      const std::string padding(widths[column] - row[column].size(), ' ');
      if (column > 0) line += "  ";
      line += text_columns_.count(column) > 0 ? row[column] + padding : padding + row[column];
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

}  // namespace sdmt::tools
