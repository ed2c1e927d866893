// SPDX-License-Identifier: Apache-2.0
#include "sdmt/image/preprocessing.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace sdmt::image {

void Preprocessing::validate() const {
  constexpr int kLargest = 4096;
  const auto refuse = [](const std::string& field, const std::string& value, const char* expected) {
    throw std::invalid_argument("preprocessing " + field + " is " + value + ", expected " +
                                expected);
  };
  if (height < 1 || height > kLargest) refuse("height", std::to_string(height), "1 to 4096");
  if (width < 1 || width > kLargest) refuse("width", std::to_string(width), "1 to 4096");
  for (const float value : mean) {
    if (!std::isfinite(value)) refuse("mean", std::to_string(value), "a finite number");
  }
  for (const float value : std) {
    if (!std::isfinite(value) || value <= 0) refuse("std", std::to_string(value), "> 0");
  }
}

}  // namespace sdmt::image
