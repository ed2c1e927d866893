// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/score_calibration.h"

#include <charconv>
#include <cmath>
#include <stdexcept>
#include <string>

namespace sdmt::track {

namespace {

struct Preset {
  std::string_view name;
  ScoreCalibration calibration;
};

constexpr Preset kPresets[] = {
    {"frcnn", {0.81, 0.11}},
    {"acf", {20.5, 22.1}},
    {"synthetic", {0.26, 0.52}},
};

bool parse_number(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

double ScoreCalibration::probability(double score) const {
  return 1 / (1 + std::exp(-(score - midpoint) / scale));
}

void ScoreCalibration::validate() const {
  if (!std::isfinite(midpoint)) {
    throw std::invalid_argument("calibration midpoint is not finite");
  }
  if (!std::isfinite(scale) || scale <= 0) {
    throw std::invalid_argument("calibration scale is " + std::to_string(scale) +
                                ", expected a finite value > 0");
  }
}

std::optional<ScoreCalibration> parse_calibration(std::string_view text) {
  if (text == "none") return std::nullopt;
  for (const Preset& preset : kPresets) {
    if (text == preset.name) return preset.calibration;
  }
  ScoreCalibration own;
  const std::size_t comma = text.find(',');
  if (comma == std::string_view::npos || !parse_number(text.substr(0, comma), own.midpoint) ||
      !parse_number(text.substr(comma + 1), own.scale)) {
    throw std::invalid_argument("calibration is '" + std::string(text) +
                                "', expected none, frcnn, acf, synthetic or MIDPOINT,SCALE");
  }
  own.validate();
  return own;
}

}  // namespace sdmt::track
