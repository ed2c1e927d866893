// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/assignment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <stdexcept>
#include <string>
#include <utility>

namespace sdmt::mot {

namespace {

constexpr int kNone = -1;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Arc {
  int column;
  double cost;
};

// Rows with their arcs, in compressed form; costs are negated weights.
struct Graph {
  std::vector<int> first;  // [rows + 1]
  std::vector<Arc> arcs;   // by row, then column

  std::span<const Arc> of(int row) const {
    return std::span(arcs).subspan(first[row], first[row + 1] - first[row]);
  }
};

std::string name(const AssignmentEdge& edge) {
  return "assignment pair (" + std::to_string(edge.row) + ", " + std::to_string(edge.column) + ")";
}

Graph make_graph(int rows, int columns, std::span<const AssignmentEdge> edges) {
  Graph graph;
  graph.first.assign(rows + 1, 0);
  for (const auto& edge : edges) {
    if (edge.row < 0 || edge.row >= rows || edge.column < 0 || edge.column >= columns) {
      throw std::invalid_argument(name(edge) + " lies outside " + std::to_string(rows) + " x " +
                                  std::to_string(columns));
    }
    if (!std::isfinite(edge.weight)) {
      throw std::invalid_argument(name(edge) + " has a weight that is not finite");
    }
    if (edge.weight > 0) ++graph.first[edge.row + 1];
  }
  for (int row = 0; row < rows; ++row) {
    graph.first[row + 1] += graph.first[row];
  }
  graph.arcs.resize(graph.first.back());
  std::vector<int> next(graph.first.begin(), graph.first.end() - 1);
  for (const auto& edge : edges) {
    if (!(edge.weight > 0)) continue;
    graph.arcs[next[edge.row]++] = {edge.column, -edge.weight};
  }
  for (int row = 0; row < rows; ++row) {
    const auto begin = graph.arcs.begin() + graph.first[row];
    const auto end = graph.arcs.begin() + graph.first[row + 1];
    const auto by_column = [](const Arc& a, const Arc& b) { return a.column < b.column; };
    const auto same_column = [](const Arc& a, const Arc& b) { return a.column == b.column; };
    std::sort(begin, end, by_column);
    const auto twice = std::adjacent_find(begin, end, same_column);
    if (twice != end)
      throw std::invalid_argument(name({row, twice->column, 0}) + " is listed twice");
  }
  return graph;
}

// Reduced costs cost - row_price - column_price stay >= 0, and 0 on assigned pairs. Staying alone
// is a column of the row's own, of cost and price 0.
class Solver {
 public:
  Solver(int rows, int columns, const Graph& graph)
      : graph_(graph),
        row_price_(rows, 0.0),
        column_price_(columns, 0.0),
        column_of_(rows, kNone),
        row_of_(columns, kNone),
        distance_(columns, kInfinity),
        reached_from_(columns, kNone),
        done_(columns, 0) {}

  std::vector<int> solve() {
    for (int row = 0; row < static_cast<int>(column_of_.size()); ++row) add_row(row);
    return std::move(column_of_);
  }

 private:
  // Dijkstra from the new row over alternating paths to the nearest end: a free column, or a row
  // (the new one or one already assigned) that had better stay alone.
  void add_row(int source) {
    int alone = source;
    double best = -row_price(source);
    int free_column = kNone;
    relax(source, 0.0);
    while (!queue_.empty()) {
      const auto [distance, column] = queue_.top();
      queue_.pop();
      if (done_[column] || distance > distance_[column]) continue;
      if (distance >= best) break;
      const int owner = row_of_[column];
      if (owner == kNone) {
        free_column = column;
        best = distance;
        break;
      }
      done_[column] = 1;
      finished_.push_back(column);
      if (distance - row_price(owner) < best) {
        best = distance - row_price(owner);
        alone = owner;
      }
      relax(owner, distance);
    }
    update_prices(source, best);
    augment(source, alone, free_column);
    reset();
  }

  void relax(int row, double distance) {
    for (const Arc& arc : graph_.of(row)) {
      const int column = arc.column;
      const double candidate = distance + arc.cost - row_price(row) - column_price_[column];
      if (done_[column] || candidate >= distance_[column]) continue;
      if (distance_[column] == kInfinity) touched_.push_back(column);
      distance_[column] = candidate;
      reached_from_[column] = row;
      queue_.emplace(candidate, column);
    }
  }

  void update_prices(int source, double best) {
    row_price_[source] += best;
    for (const int column : finished_) {
      const double change = best - distance_[column];
      if (change <= 0) continue;
      row_price_[row_of_[column]] += change;
      column_price_[column] -= change;
    }
  }

  // Flips the path that ends in `free_column`, or in the row `alone` giving up its column.
  void augment(int source, int alone, int free_column) {
    int column = free_column;
    if (column == kNone) column = std::exchange(column_of_[alone], kNone);
    while (column != kNone) {
      const int row = reached_from_[column];
      row_of_[column] = row;
      column = std::exchange(column_of_[row], column);
      if (row == source) break;
    }
  }

  void reset() {
    for (const int column : touched_) {
      distance_[column] = kInfinity;
      done_[column] = 0;
    }
    touched_.clear();
    finished_.clear();
    queue_ = {};
  }

  double row_price(int row) const { return row_price_[row]; }

  using Reached = std::pair<double, int>;  // distance, column: ties go to the lower column

  const Graph& graph_;
  std::vector<double> row_price_, column_price_;
  std::vector<int> column_of_, row_of_;
  std::vector<double> distance_;
  std::vector<int> reached_from_;
  std::vector<unsigned char> done_;
  std::vector<int> touched_, finished_;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> queue_;
};

}  // namespace

std::vector<int> maximum_weight_assignment(int rows, int columns,
                                           std::span<const AssignmentEdge> edges) {
  const Graph graph = make_graph(rows, columns, edges);
  return Solver(rows, columns, graph).solve();
}

}  // namespace sdmt::mot
