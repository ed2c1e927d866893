// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "sdmt/io/option_table.h"

namespace sdmt::python {

/// Options as the package hands them over: named as on the command line, values as text.
using OptionTexts = std::map<std::string, std::string>;

/// The defaults with these values, not validated together. Throws std::invalid_argument
/// `the OWNER has no option 'NAME'`, and as the option does.
template <typename Options>
Options to_options(const OptionTexts& texts, const io::OptionTable<Options>& table,
                   const char* owner) {
  Options options;
  for (const auto& [name, text] : texts) table.named(name, owner).set(options, text);
  return options;
}

}  // namespace sdmt::python
