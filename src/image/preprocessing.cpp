// SPDX-License-Identifier: Apache-2.0
#include "sdmt/image/preprocessing.h"

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace sdmt::image {

void Preprocessing::validate() const {
  constexpr int kLargest = 4096;
  constexpr float kLargestMean = 10.0F, kSmallestStd = 1e-3F, kLargestStd = 1e3F;
  const auto refuse = [](const std::string& field, double value, const char* expected) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", value);
    throw std::invalid_argument("preprocessing " + field + " is " + text + ", expected " +
                                expected);
  };
  if (height < 1 || height > kLargest) refuse("height", height, "1 to 4096");
  if (width < 1 || width > kLargest) refuse("width", width, "1 to 4096");
  for (const float value : mean) {
    if (!(std::abs(value) <= kLargestMean)) refuse("mean", value, "-10 to 10");
  }
  for (const float value : std) {
    if (!(value >= kSmallestStd && value <= kLargestStd)) {
      refuse("std", value, "0.001 to 1000");
    }
  }
}

}  // namespace sdmt::image
