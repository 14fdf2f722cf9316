// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/executor.h"
#include "design/transport/laplacian_solver.h"

namespace lensforge {

struct MultigridOptions {
  double tolerance = 1e-3;  ///< Ends when the residual is below this share of the right side.
  int max_iterations = 60;
};

struct MultigridSolution {
  Eigen::VectorXd x;      ///< Up to a constant.
  int iterations = 0;     ///< Of conjugate gradients.
  double residual = 0.0;  ///< Relative to the right side.
};

/// Solves a graph's Laplace equation by flexible conjugate gradients, preconditioned by a K-cycle
/// over aggregates of about four nodes (Notay, "An aggregation-based algebraic multigrid method",
/// 2010). Weights may differ by many orders of magnitude between regions, as they do between white
/// and black; where neighbouring edges differ so at random it does not converge.
/// @pre right sums to about 0. @throw Interrupted if the executor's stop is requested.
MultigridSolution solve_by_multigrid(const WeightedGraph& graph, const Eigen::VectorXd& right,
                                     const MultigridOptions& options, const Executor& executor);

}  // namespace lensforge
