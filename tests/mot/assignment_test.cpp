// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/assignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <stdexcept>
#include <vector>

#include "sdmt/nn/random.h"

namespace sdmt::mot {
namespace {

using Edges = std::vector<AssignmentEdge>;

// Best total over every way to assign rows from `row` on.
double best_by_enumeration(int rows, const std::vector<std::vector<double>>& weight, int row,
                           std::vector<bool>& taken) {
  if (row == rows) return 0;
  double best = best_by_enumeration(rows, weight, row + 1, taken);
  for (std::size_t column = 0; column < taken.size(); ++column) {
    const double w = weight[row][column];
    if (taken[column] || w <= 0) continue;
    taken[column] = true;
    best = std::max(best, w + best_by_enumeration(rows, weight, row + 1, taken));
    taken[column] = false;
  }
  return best;
}

TEST(MaximumWeightAssignment, EqualsEnumerationOnRandomGraphs) {
  nn::Random random(7);
  for (int round = 0; round < 3000; ++round) {
    const int rows = static_cast<int>(random.below(6));
    const int columns = static_cast<int>(random.below(7));
    const bool coarse = random.uniform() < 0.5;  // many ties
    std::vector<std::vector<double>> weight(rows);
    Edges edges;
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; j < columns; ++j) {
        double w = random.uniform() < 0.6 ? random.uniform() * 2 - 0.3 : 0.0;
        if (coarse) w = static_cast<double>(static_cast<int>(w * 3));
        weight[i].push_back(w);
        if (w != 0) edges.push_back({i, j, w});
      }
    }
    const auto assigned = maximum_weight_assignment(rows, columns, edges);
    ASSERT_EQ(assigned.size(), static_cast<std::size_t>(rows));
    double total = 0;
    std::set<int> used;
    for (int i = 0; i < rows; ++i) {
      const int column = assigned[i];
      if (column < 0) continue;
      const double w = weight[i][column];
      EXPECT_GT(w, 0);
      EXPECT_TRUE(used.insert(column).second);
      total += w;
    }
    std::vector<bool> taken(columns, false);
    ASSERT_NEAR(total, best_by_enumeration(rows, weight, 0, taken), 1e-12);

    std::reverse(edges.begin(), edges.end());
    EXPECT_EQ(maximum_weight_assignment(rows, columns, edges), assigned);
  }
}

TEST(MaximumWeightAssignment, BestSinglePairMayBeLeftOut) {
  // 0.9 + nothing < 0.8 + 0.7.
  const Edges edges{{0, 0, 0.9}, {0, 1, 0.8}, {1, 0, 0.7}};
  EXPECT_EQ(maximum_weight_assignment(2, 2, edges), (std::vector<int>{1, 0}));
}

TEST(MaximumWeightAssignment, NothingToAssign) {
  EXPECT_TRUE(maximum_weight_assignment(0, 3, Edges{}).empty());
  EXPECT_EQ(maximum_weight_assignment(2, 0, Edges{}), (std::vector<int>{-1, -1}));
  EXPECT_EQ(maximum_weight_assignment(1, 1, Edges{{0, 0, -1.0}}), (std::vector<int>{-1}));
}

TEST(MaximumWeightAssignment, RefusesBadEdges) {
  EXPECT_THROW(maximum_weight_assignment(1, 1, Edges{{1, 0, 1.0}}), std::invalid_argument);
  EXPECT_THROW(maximum_weight_assignment(1, 1, Edges{{0, -1, 1.0}}), std::invalid_argument);
  EXPECT_THROW(maximum_weight_assignment(1, 1, Edges{{0, 0, 1.0}, {0, 0, 2.0}}),
               std::invalid_argument);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(maximum_weight_assignment(1, 1, Edges{{0, 0, nan}}), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::mot
