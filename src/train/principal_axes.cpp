// SPDX-License-Identifier: Apache-2.0
#include "principal_axes.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "sdmt/io/first_error.h"

namespace sdmt::train {

namespace {

using Row = std::vector<double>;

double dot(const Row& a, const Row& b) {
  double sum = 0;
#pragma omp simd reduction(+ : sum)
  for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
  return sum;
}

std::vector<Row> second_moments(const nn::Tensor& vectors) {
  const auto size = static_cast<std::size_t>(vectors.shape().c);
  std::vector<Row> moments(size, Row(size, 0.0));
  // nothing throws
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < size; ++i) {
    for (int n = 0; n < vectors.shape().n; ++n) {
      const float* row = vectors.image(n);
      const double factor = row[i];
      for (std::size_t k = 0; k < size; ++k) moments[i][k] += factor * row[k];
    }
  }
  return moments;
}

// One-sided Jacobi (Hestenes, 1958): rotates pairs of rows until all are orthogonal. Of a symmetric
// matrix without negative eigenvalues, the rows are then the eigenvectors times their eigenvalues.
void orthogonalize(std::vector<Row>& rows) {
  constexpr double kOrthogonal = 1e-12;  // cosine
  constexpr int kSweeps = 40;            // about ten are needed
  bool rotated = true;
  for (int sweep = 0; rotated && sweep < kSweeps; ++sweep) {
    rotated = false;
    for (std::size_t p = 0; p < rows.size(); ++p) {
      for (std::size_t q = p + 1; q < rows.size(); ++q) {
        const double pp = dot(rows[p], rows[p]), qq = dot(rows[q], rows[q]);
        const double pq = dot(rows[p], rows[q]);
        if (std::abs(pq) <= kOrthogonal * std::sqrt(pp * qq)) continue;
        rotated = true;
        const double zeta = (qq - pp) / (2 * pq);
        const double t = (zeta < 0 ? -1 : 1) / (std::abs(zeta) + std::hypot(1.0, zeta));
        const double c = 1 / std::sqrt(1 + t * t), s = c * t;
        for (std::size_t k = 0; k < rows.size(); ++k) {
          const double a = rows[p][k], b = rows[q][k];
          rows[p][k] = c * a - s * b;
          rows[q][k] = s * a + c * b;
        }
      }
    }
  }
}

// Scales to length 1, if it has one; returns the length.
double normalize(Row& row) {
  const double length = std::sqrt(dot(row, row));
  for (double& value : row) value /= length > 0 ? length : 1;
  return length;
}

// The `count` eigenvectors of largest eigenvalue, largest first, and the share of all eigenvalues.
std::pair<std::vector<Row>, double> principal_axes(std::vector<Row> moments, std::size_t count) {
  orthogonalize(moments);
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < moments.size(); ++i) order.emplace_back(-normalize(moments[i]), i);
  std::sort(order.begin(), order.end());
  std::vector<Row> axes;
  double kept = 0, all = 0;
  for (const auto& [negative_eigenvalue, i] : order) {
    all -= negative_eigenvalue;
    if (axes.size() == count) continue;
    kept -= negative_eigenvalue;
    axes.push_back(std::move(moments[i]));
  }
  return {std::move(axes), kept / all};
}

}  // namespace

Projection project(const nn::Tensor& vectors, int dimensions) {
  const int count = vectors.shape().n, size = vectors.shape().c;
  Projection result;
  if (size == dimensions) {
    result.rows = vectors;
    return result;
  }
  result.rows = nn::Tensor({count, 1, 1, dimensions});
  if (size < dimensions) {
    for (int i = 0; i < count; ++i) std::copy_n(vectors.image(i), size, result.rows.image(i));
    return result;
  }
  std::vector<Row> axes;
  std::tie(axes, result.kept) =
      principal_axes(second_moments(vectors), static_cast<std::size_t>(dimensions));
  io::FirstError error;
#pragma omp parallel for schedule(static)
  for (int i = 0; i < count; ++i) {
    error.guard([&] {
      const Row row(vectors.image(i), vectors.image(i) + size);
      Row coordinates;
      for (const Row& axis : axes) coordinates.push_back(dot(axis, row));
      normalize(coordinates);
      std::copy(coordinates.begin(), coordinates.end(), result.rows.image(i));
    });
  }
  error.rethrow();
  return result;
}

}  // namespace sdmt::train
