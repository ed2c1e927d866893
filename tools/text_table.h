// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace sdmt::tools {

/// A table for the terminal: columns as wide as their widest cell, the first set left, the others
/// right.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header);

  /// Throws std::logic_error unless there is a cell for each column.
  void add_row(std::vector<std::string> cells);
  /// A line of dashes.
  void add_rule();
  std::string str() const;

 private:
  std::vector<std::vector<std::string>> rows_;  // the header first; an empty row is a rule
};

}  // namespace sdmt::tools
