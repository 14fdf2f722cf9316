// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/laplacian.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace lensforge {
namespace {

/// Relative shift that keeps the factorisation positive; far above rounding of the diagonal's sums.
constexpr double kShift = 1e-13;

using Sparse = Eigen::SparseMatrix<double>;

/// Lower half of the Laplacian.
Sparse laplacian(const WeightedGraph& graph) {
  Eigen::VectorXd diagonal = Eigen::VectorXd::Zero(graph.nodes);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(graph.edges.size() + static_cast<std::size_t>(graph.nodes));
  for (const WeightedGraph::Edge& e : graph.edges) {
    entries.emplace_back(std::max(e.a, e.b), std::min(e.a, e.b), -e.weight);
    diagonal[e.a] += e.weight;
    diagonal[e.b] += e.weight;
  }
  // Lets the factorisation succeed with a node without weights.
  const double least = std::max(1e-30, 0.1 * kShift * diagonal.maxCoeff());
  for (int i = 0; i < graph.nodes; ++i) {
    entries.emplace_back(i, i, (1.0 + kShift) * diagonal[i] + least);
  }
  Sparse matrix(graph.nodes, graph.nodes);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace

struct LaplacianFactor::Factor {
  Eigen::SimplicialLDLT<Sparse, Eigen::Lower> cholesky;
};

LaplacianFactor::LaplacianFactor(const WeightedGraph& graph) : factor_(std::make_unique<Factor>()) {
  factor_->cholesky.compute(laplacian(graph));
}

LaplacianFactor::~LaplacianFactor() = default;

Eigen::VectorXd LaplacianFactor::solve(const Eigen::VectorXd& right) const {
  if (factor_->cholesky.info() != Eigen::Success) {
    return Eigen::VectorXd::Constant(right.size(), std::numeric_limits<double>::quiet_NaN());
  }
  return factor_->cholesky.solve(right);
}

namespace {

using Vector = std::vector<double>;

/// A graph's Laplacian by rows: every node's neighbours with weights, and the weights' sum. In a
/// row, neighbours of lower numbers come before those of higher numbers, which begin at `higher`.
struct Rows {
  std::vector<std::int32_t> first;
  std::vector<std::int32_t> higher;
  std::vector<std::int32_t> other;
  Vector weight;
  Vector diagonal;

  [[nodiscard]] std::size_t size() const { return diagonal.size(); }
};

/// Moves lower neighbours to the front and keeps the order of both parts.
void part_rows(Rows& rows) {
  rows.higher.resize(rows.size());
  std::vector<std::pair<std::int32_t, double>> later;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    later.clear();
    auto to = static_cast<std::size_t>(rows.first[i]);
    const auto end = static_cast<std::size_t>(rows.first[i + 1]);
    for (std::size_t k = to; k < end; ++k) {
      if (rows.other[k] > static_cast<std::int32_t>(i)) {
        later.emplace_back(rows.other[k], rows.weight[k]);
      } else {
        rows.other[to] = rows.other[k];
        rows.weight[to++] = rows.weight[k];
      }
    }
    rows.higher[i] = static_cast<std::int32_t>(to);
    for (const auto& [other, weight] : later) {
      rows.other[to] = other;
      rows.weight[to++] = weight;
    }
  }
}

Rows rows_of(const WeightedGraph& graph) {
  Rows rows;
  const auto n = static_cast<std::size_t>(graph.nodes);
  rows.first.assign(n + 1, 0);
  for (const WeightedGraph::Edge& e : graph.edges) {
    ++rows.first[static_cast<std::size_t>(e.a) + 1];
    ++rows.first[static_cast<std::size_t>(e.b) + 1];
  }
  for (std::size_t i = 0; i < n; ++i) rows.first[i + 1] += rows.first[i];
  rows.other.resize(2 * graph.edges.size());
  rows.weight.resize(2 * graph.edges.size());
  rows.diagonal.assign(n, 0.0);
  std::vector<std::int32_t> next(rows.first.begin(), rows.first.end() - 1);
  const auto add = [&](int a, int b, double weight) {
    const auto k = static_cast<std::size_t>(next[static_cast<std::size_t>(a)]++);
    rows.other[k] = b;
    rows.weight[k] = weight;
    rows.diagonal[static_cast<std::size_t>(a)] += weight;
  };
  for (const WeightedGraph::Edge& e : graph.edges) {
    add(e.a, e.b, e.weight);
    add(e.b, e.a, e.weight);
  }
  part_rows(rows);
  return rows;
}

/// Pairs every node with the unpaired neighbour of the largest weight, unless that is weak.
std::vector<std::int32_t> pair_nodes(const Rows& rows, int& count) {
  constexpr double kWeak = 0.25;  // of the strongest tie; Notay's choice
  std::vector<std::int32_t> pair(rows.size(), -1);
  count = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (pair[i] >= 0) continue;
    double strongest = 0.0;
    double best = 0.0;
    std::size_t mate = i;
    for (auto k = static_cast<std::size_t>(rows.first[i]);
         k < static_cast<std::size_t>(rows.first[i + 1]); ++k) {
      const auto j = static_cast<std::size_t>(rows.other[k]);
      strongest = std::max(strongest, rows.weight[k]);
      if (pair[j] < 0 && rows.weight[k] > best) {
        best = rows.weight[k];
        mate = j;
      }
    }
    pair[i] = count;
    if (best >= kWeak * strongest) pair[mate] = count;
    ++count;
  }
  return pair;
}

/// The Laplacian of the graph whose nodes are aggregates.
Rows aggregated(const Rows& rows, const std::vector<std::int32_t>& aggregate, int count) {
  const auto n = static_cast<std::size_t>(count);
  std::vector<std::int32_t> start(n + 1, 0);
  for (const std::int32_t a : aggregate) ++start[static_cast<std::size_t>(a) + 1];
  for (std::size_t i = 0; i < n; ++i) start[i + 1] += start[i];
  std::vector<std::int32_t> members(aggregate.size());
  std::vector<std::int32_t> next(start.begin(), start.end() - 1);
  for (std::size_t i = 0; i < aggregate.size(); ++i) {
    members[static_cast<std::size_t>(next[static_cast<std::size_t>(aggregate[i])]++)] =
        static_cast<std::int32_t>(i);
  }
  Rows coarse;
  coarse.first.reserve(n + 1);
  coarse.first.push_back(0);
  coarse.diagonal.assign(n, 0.0);
  std::vector<std::int32_t> place(n, -1);
  for (std::size_t a = 0; a < n; ++a) {
    const auto row_begin = static_cast<std::int32_t>(coarse.other.size());
    for (auto m = static_cast<std::size_t>(start[a]); m < static_cast<std::size_t>(start[a + 1]);
         ++m) {
      const auto i = static_cast<std::size_t>(members[m]);
      for (auto k = static_cast<std::size_t>(rows.first[i]);
           k < static_cast<std::size_t>(rows.first[i + 1]); ++k) {
        const std::int32_t b = aggregate[static_cast<std::size_t>(rows.other[k])];
        if (b == static_cast<std::int32_t>(a)) continue;
        std::int32_t& at = place[static_cast<std::size_t>(b)];
        if (at < row_begin) {
          at = static_cast<std::int32_t>(coarse.other.size());
          coarse.other.push_back(b);
          coarse.weight.push_back(0.0);
        }
        coarse.weight[static_cast<std::size_t>(at)] += rows.weight[k];
        coarse.diagonal[a] += rows.weight[k];
      }
    }
    coarse.first.push_back(static_cast<std::int32_t>(coarse.other.size()));
  }
  part_rows(coarse);
  return coarse;
}

double dot(const Vector& a, const Vector& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

void add_scaled(Vector& to, double factor, const Vector& what) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += factor * what[i];
}

/// Σ weight · x of some neighbours.
double weighted_sum(const Rows& rows, std::int32_t begin, std::int32_t end, const Vector& x) {
  double sum = 0.0;
  for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
    sum += rows.weight[k] * x[static_cast<std::size_t>(rows.other[k])];
  }
  return sum;
}
double lower_sum(const Rows& rows, std::size_t i, const Vector& x) {
  return weighted_sum(rows, rows.first[i], rows.higher[i], x);
}
double higher_sum(const Rows& rows, std::size_t i, const Vector& x) {
  return weighted_sum(rows, rows.higher[i], rows.first[i + 1], x);
}
double neighbour_sum(const Rows& rows, std::size_t i, const Vector& x) {
  return weighted_sum(rows, rows.first[i], rows.first[i + 1], x);
}

Vector multiply(const Rows& rows, const Vector& x, const Executor& executor) {
  Vector y(x.size());
  parallel_for(executor, "laplacian", static_cast<std::int64_t>(x.size()), [&](std::int64_t k) {
    const auto i = static_cast<std::size_t>(k);
    y[i] = rows.diagonal[i] * x[i] - neighbour_sum(rows, i, x);
  });
  return y;
}

WeightedGraph graph_of(const Rows& rows) {
  WeightedGraph graph;
  graph.nodes = static_cast<int>(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (auto k = static_cast<std::size_t>(rows.first[i]);
         k < static_cast<std::size_t>(rows.first[i + 1]); ++k) {
      if (rows.other[k] > static_cast<std::int32_t>(i)) {
        graph.edges.push_back({static_cast<int>(i), rows.other[k], rows.weight[k]});
      }
    }
  }
  return graph;
}

/// Below this many nodes the equation is solved directly.
constexpr std::size_t kDirectSize = 1500;

class Hierarchy {
 public:
  Hierarchy(const WeightedGraph& graph, const Executor& executor) : executor_(executor) {
    levels_.push_back({rows_of(graph), {}});
    while (levels_.back().rows.size() > kDirectSize) {
      int pairs = 0;
      int count = 0;
      const Rows& fine = levels_.back().rows;
      std::vector<std::int32_t> aggregate = pair_nodes(fine, pairs);
      const Rows paired = aggregated(fine, aggregate, pairs);
      const std::vector<std::int32_t> second = pair_nodes(paired, count);
      // Unconnected nodes would never be merged.
      if (static_cast<double>(count) > 0.8 * static_cast<double>(fine.size())) break;
      for (std::int32_t& a : aggregate) a = second[static_cast<std::size_t>(a)];
      levels_.back().aggregate = std::move(aggregate);
      levels_.push_back({aggregated(paired, second, count), {}});
    }
    coarsest_ = std::make_unique<LaplacianFactor>(graph_of(levels_.back().rows));
  }

  [[nodiscard]] const Rows& finest() const { return levels_.front().rows; }

  /// An approximate solution of level l's equation.
  [[nodiscard]] Vector precondition(std::size_t l, const Vector& right) const {
    if (l + 1 == levels_.size()) return solve_coarsest(right);
    const Rows& rows = levels_[l].rows;
    Vector x = swept_forward(rows, right);
    const Vector residual = residual_after_sweep(rows, right, x);
    const std::vector<std::int32_t>& aggregate = levels_[l].aggregate;
    Vector coarse(levels_[l + 1].rows.size(), 0.0);
    for (std::size_t i = 0; i < x.size(); ++i) {
      coarse[static_cast<std::size_t>(aggregate[i])] += residual[i];
    }
    const Vector correction = cycle(l + 1, coarse);
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] += correction[static_cast<std::size_t>(aggregate[i])];
    }
    sweep_backward(rows, right, x);
    return x;
  }

 private:
  struct Level {
    Rows rows;
    std::vector<std::int32_t> aggregate;  ///< Node → node of the next level.
  };

  /// At most two steps of conjugate gradients on level l (Notay 2010, Algorithm 3.2).
  [[nodiscard]] Vector cycle(std::size_t l, const Vector& right) const {
    constexpr double kGoodEnough = 0.25;
    Vector first = precondition(l, right);
    if (l + 1 == levels_.size()) return first;
    const Rows& rows = levels_[l].rows;
    const Vector first_image = multiply(rows, first, executor_);
    const double first_energy = dot(first, first_image);
    if (!(first_energy > 0.0)) return first;
    const double step = dot(first, right) / first_energy;
    Vector residual = right;
    add_scaled(residual, -step, first_image);
    if (dot(residual, residual) <= kGoodEnough * kGoodEnough * dot(right, right)) {
      for (double& v : first) v *= step;
      return first;
    }
    const Vector second = precondition(l, residual);
    const Vector second_image = multiply(rows, second, executor_);
    const double mixed = dot(second, first_image);
    const double second_energy = dot(second, second_image) - mixed * mixed / first_energy;
    if (!(second_energy > 0.0)) {
      for (double& v : first) v *= step;
      return first;
    }
    const double second_step = dot(second, residual) / second_energy;
    const double factor = step - mixed * second_step / first_energy;
    for (std::size_t i = 0; i < first.size(); ++i) {
      first[i] = factor * first[i] + second_step * second[i];
    }
    return first;
  }

  [[nodiscard]] Vector solve_coarsest(const Vector& right) const {
    Eigen::VectorXd b =
        Eigen::Map<const Eigen::VectorXd>(right.data(), static_cast<Eigen::Index>(right.size()));
    b.array() -= b.mean();
    const Eigen::VectorXd x = coarsest_->solve(b);
    return {x.data(), x.data() + x.size()};
  }

  /// Gauss-Seidel from 0; higher neighbours add nothing.
  static Vector swept_forward(const Rows& rows, const Vector& right) {
    Vector x(right.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] = rows.diagonal[i] > 0.0 ? (right[i] + lower_sum(rows, i, x)) / rows.diagonal[i] : 0.0;
    }
    return x;
  }
  /// The residual of such a sweep in a row is the sum over its higher neighbours' new values.
  [[nodiscard]] Vector residual_after_sweep(const Rows& rows, const Vector& right,
                                            const Vector& x) const {
    Vector residual(x.size());
    parallel_for(executor_, "laplacian", static_cast<std::int64_t>(x.size()), [&](std::int64_t k) {
      const auto i = static_cast<std::size_t>(k);
      residual[i] = rows.diagonal[i] > 0.0 ? higher_sum(rows, i, x) : right[i];
    });
    return residual;
  }
  static void sweep_backward(const Rows& rows, const Vector& right, Vector& x) {
    for (std::size_t i = x.size(); i-- > 0;) {
      if (rows.diagonal[i] > 0.0) x[i] = (right[i] + neighbour_sum(rows, i, x)) / rows.diagonal[i];
    }
  }

  const Executor& executor_;
  std::vector<Level> levels_;
  std::unique_ptr<LaplacianFactor> coarsest_;  ///< Factorised once for a cycle's several solutions.
};

}  // namespace

MultigridSolution solve_by_multigrid(const WeightedGraph& graph, const Eigen::VectorXd& right,
                                     const MultigridOptions& options, const Executor& executor) {
  const Hierarchy hierarchy(graph, executor);
  Vector residual(right.data(), right.data() + right.size());
  const double size = std::sqrt(dot(residual, residual));
  Vector x(residual.size(), 0.0);
  Vector direction;
  Vector image;
  double energy = 1.0;
  MultigridSolution solution;
  solution.residual = 1.0;
  while (size > 0.0 && solution.residual > options.tolerance &&
         solution.iterations < options.max_iterations) {
    Vector next = hierarchy.precondition(0, residual);
    if (solution.iterations > 0) add_scaled(next, -dot(next, image) / energy, direction);
    direction = std::move(next);
    image = multiply(hierarchy.finest(), direction, executor);
    energy = dot(direction, image);
    if (!(energy > 0.0)) break;
    const double step = dot(direction, residual) / energy;
    add_scaled(x, step, direction);
    add_scaled(residual, -step, image);
    solution.residual = std::sqrt(dot(residual, residual)) / size;
    ++solution.iterations;
  }
  solution.x = Eigen::Map<const Eigen::VectorXd>(x.data(), right.size());
  return solution;
}

}  // namespace lensforge
