// SPDX-License-Identifier: Apache-2.0
#include "cli/text_table.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "cli/console.h"

namespace sdmt::tools {

namespace {

constexpr std::size_t kGap = 2;  // blanks between columns

}  // namespace

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
  const auto width = console_width(stdout);
  std::vector<std::size_t> widths(rows_.front().size(), 0);
  for (const auto& row : rows_) {
    for (std::size_t column = 0; column < row.size(); ++column) {
      widths[column] = std::max(widths[column], row[column].size());
    }
  }
  std::string text;
  std::vector<std::size_t> columns{0};
  std::size_t used = widths[0];
  for (std::size_t column = 1; column < widths.size(); ++column) {
    const bool sentence = column + 1 == widths.size() && text_columns_.contains(column);
    const bool full = width && used + kGap + widths[column] > static_cast<std::size_t>(*width);
    if (full && !sentence && columns.size() > 1) {
      text += block(columns, widths) + "\n";
      columns.resize(1);
      used = widths[0];
    }
    columns.push_back(column);
    used += kGap + widths[column];
  }
  return text + block(columns, widths);
}

std::string TextTable::block(std::span<const std::size_t> columns,
                             std::span<const std::size_t> widths) const {
  std::string text;
  std::size_t total = 0;
  for (const std::size_t column : columns) total += widths[column] + (column == 0 ? 0 : kGap);
  for (const auto& row : rows_) {
    if (row.empty()) {
      text += std::string(total, '-') + "\n";
      continue;
    }
    std::string line;
    for (const std::size_t column : columns) {
      const std::string padding(widths[column] - row[column].size(), ' ');
      if (column > 0) line += std::string(kGap, ' ');
      line += text_columns_.count(column) > 0 ? row[column] + padding : padding + row[column];
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

}  // namespace sdmt::tools
