// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

namespace sdmt::mot {

/// A pair that may be assigned, and what assigning it is worth. Pairs not listed are forbidden.
struct AssignmentEdge {
  int row = 0;
  int column = 0;
  double weight = 0;  ///< finite; an edge of weight <= 0 is never worth taking and is ignored
};

/// Assigns rows to columns, each at most once, so that the total weight is greatest (exact optimum,
/// in double precision). Returns the column of each row, -1 where the row stays alone.
///
/// Successive shortest augmenting paths (Jonker and Volgenant 1987) over the listed pairs only:
/// O(rows * edges * log columns) in the worst case, near linear for the sparse graphs that
/// overlapping boxes make. Equal optima are told apart by the order of rows and columns, so the
/// result does not depend on the order of `edges`.
/// Throws std::invalid_argument for an edge outside [0, rows) x [0, columns), a pair listed twice
/// or a weight that is not finite.
std::vector<int> maximum_weight_assignment(int rows, int columns,
                                           std::span<const AssignmentEdge> edges);

}  // namespace sdmt::mot
