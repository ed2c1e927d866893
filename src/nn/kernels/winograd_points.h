// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace sdmt::nn {

/// Interpolation points of Winograd's F(n,3) in one dimension, n even: 0, +-p for n / 2 values p,
/// and infinity. The values come in pairs p, 1 / p, so that the product of all p is 1. Those here
/// have the least rounding error (docs/performance.md).
template <int kTile>
inline constexpr std::array<double, static_cast<std::size_t>(kTile / 2)> kWinogradPoints = {};
template <>
inline constexpr std::array<double, 1> kWinogradPoints<2> = {1.0};
template <>
inline constexpr std::array<double, 2> kWinogradPoints<4> = {0.70710678118654752440,
                                                             1.41421356237309504880};
template <>
inline constexpr std::array<double, 4> kWinogradPoints<8> = {1 / 2.4, 0.8, 1.25, 2.4};

/// What the transforms of F(n,3) are made of, by the Toom-Cook construction. Index i counts the
/// values p, k the powers of x^2.
template <int kTile>
struct WinogradCoefficients {
  static constexpr int kPairs = kTile / 2;
  static constexpr auto kPairCount = static_cast<std::size_t>(kPairs);
  using Row = std::array<double, kPairCount + 1>;

  std::array<double, kPairCount> point = kWinogradPoints<kTile>;
  Row product{};                           ///< of x^2 - p^2 over all p
  std::array<Row, kPairCount> others{};    ///< of x^2 - p^2 over all p but point[i]
  std::array<double, kPairCount> scale{};  ///< of the weights at +-point[i]
  std::array<std::array<double, kTile>, kPairCount> power{};  ///< point[i]^j

  constexpr WinogradCoefficients() {
    product = without(kPairCount);
    product[0] = kPairs % 2 == 0 ? 1.0 : -1.0;  // as the product of all p is 1
    for (std::size_t i = 0; i < kPairCount; ++i) {
      others[i] = without(i);
      double value = 0.0;
      double at = 1.0;
      for (std::size_t k = 0; k < kPairCount; ++k, at *= point[i] * point[i]) {
        value += others[i][k] * at;
      }
      scale[i] = 1.0 / (2.0 * point[i] * point[i] * value);
      power[i][0] = 1.0;
      for (std::size_t j = 1; j < kTile; ++j) power[i][j] = power[i][j - 1] * point[i];
    }
  }

 private:
  constexpr Row without(std::size_t skipped) const {
    Row row{};
    row[0] = 1.0;
    for (std::size_t i = 0; i < kPairCount; ++i) {
      if (i == skipped) continue;
      for (std::size_t k = kPairCount; k > 0; --k) {
        row[k] = row[k - 1] - point[i] * point[i] * row[k];
      }
      row[0] *= -point[i] * point[i];
    }
    return row;
  }
};

template <int kTile>
inline constexpr WinogradCoefficients<kTile> kWinograd{};

}  // namespace sdmt::nn
