// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <span>
#include <string>
#include <vector>

namespace sdmt::tools {

/// A table for the terminal: columns as wide as their widest cell, set right but for the first and
/// those named as text.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header, std::set<std::size_t> text_columns = {});

  /// Throws std::logic_error unless there is a cell for each column.
  void add_row(std::vector<std::string> cells);
  /// A line of dashes.
  void add_rule();
  /// As wide as standard output, where that is a terminal: columns that do not fit follow below,
  /// behind the first again; only text in the last column goes beyond.
  std::string str() const;

 private:
  std::string block(std::span<const std::size_t> columns,
                    std::span<const std::size_t> widths) const;

  std::vector<std::vector<std::string>> rows_;  // the header first; an empty row is a rule
  std::set<std::size_t> text_columns_;
};

}  // namespace sdmt::tools
