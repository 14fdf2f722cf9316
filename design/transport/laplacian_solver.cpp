// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/laplacian_solver.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cstddef>
#include <limits>

namespace lensforge {

namespace {

/// Keeps the factorisation positive; far above rounding of the diagonal's sums.
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
  // A node without any weight must not end the factorisation either.
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

}  // namespace lensforge
