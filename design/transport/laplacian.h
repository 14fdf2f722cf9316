// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/compute/executor.h"

namespace lensforge {

/// A graph with positive edge weights; its Laplacian is the Newton matrix of optimal transport.
struct WeightedGraph {
  struct Edge {
    int a;
    int b;
    double weight;
  };
  int nodes = 0;
  std::vector<Edge> edges;
};

/// Solves Σ_b weight_ab (x_a − x_b) = right_a by a sparse Cholesky factorisation. Eigen's is used
/// because it brings in no multi-threaded BLAS, whose bits depend on the machine. Disconnected
/// parts are held in place by a diagonal of 1e-13 relative to their own.
class LaplacianFactor {
 public:
  explicit LaplacianFactor(const WeightedGraph& graph);
  ~LaplacianFactor();
  LaplacianFactor(const LaplacianFactor&) = delete;
  LaplacianFactor& operator=(const LaplacianFactor&) = delete;

  /// @pre right sums to about 0.
  /// @return x up to a constant; not finite if the factorisation broke down.
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& right) const;

 private:
  struct Factor;
  std::unique_ptr<Factor> factor_;
};

struct MultigridOptions {
  double tolerance = 1e-3;  ///< Ends when the residual is below this share of the right side.
  int max_iterations = 60;
};

struct MultigridSolution {
  Eigen::VectorXd x;      ///< Up to a constant.
  int iterations = 0;     ///< Iterations of conjugate gradients.
  double residual = 0.0;  ///< Relative to the right side.
};

/// Solves a graph's Laplace equation by flexible conjugate gradients, preconditioned by a K-cycle
/// over aggregates of about four nodes (Notay, "An aggregation-based algebraic multigrid method",
/// 2010). Weights may differ by many orders of magnitude between regions, for example between white
/// and black; if neighbouring edges differ so at random, it does not converge.
/// @pre right sums to about 0. @throw Interrupted if the executor's stop is requested.
MultigridSolution solve_by_multigrid(const WeightedGraph& graph, const Eigen::VectorXd& right,
                                     const MultigridOptions& options, const Executor& executor);

}  // namespace lensforge
