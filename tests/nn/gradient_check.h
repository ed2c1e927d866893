// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace sdmt::nn {

struct GradientCheck {
  double worst = 0.0;     ///< largest |analytic - numeric| / largest |numeric|
  std::size_t index = 0;  ///< where
  double analytic = 0.0;  ///< there
  double numeric = 0.0;   ///< there
  std::string str() const {
    return "worst relative error " + std::to_string(worst) + " at " + std::to_string(index) +
           ": analytic " + std::to_string(analytic) + ", numeric " + std::to_string(numeric);
  }
};

/// Compares `analytic` with the central differences of `loss` in double at `point`, at every value
/// or, when there are more than `most`, at evenly spread ones. `loss` reads the point it is given
/// by reference, so it may be bound to the memory of `point`.
inline GradientCheck check_gradient(std::vector<double>& point, const std::function<double()>& loss,
                                    std::span<const float> analytic, std::size_t most = 400,
                                    double step = 1e-5) {
  std::vector<std::size_t> indices;
  const std::size_t count = std::min(most, point.size());
  for (std::size_t i = 0; i < count; ++i) indices.push_back(i * point.size() / count);
  std::vector<double> numeric;
  double largest = 1e-12;
  for (const std::size_t i : indices) {
    const double value = point[i];
    point[i] = value + step;
    const double above = loss();
    point[i] = value - step;
    const double below = loss();
    point[i] = value;
    numeric.push_back((above - below) / (2.0 * step));
    largest = std::max(largest, std::abs(numeric.back()));
  }
  GradientCheck result;
  for (std::size_t k = 0; k < indices.size(); ++k) {
    const double error = std::abs(analytic[indices[k]] - numeric[k]) / largest;
    if (!(error <= result.worst)) {  // a NaN is the worst of all
      result = {error, indices[k], analytic[indices[k]], numeric[k]};
    }
  }
  return result;
}

}  // namespace sdmt::nn
