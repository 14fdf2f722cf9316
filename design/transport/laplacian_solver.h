// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

namespace lensforge {

/// A graph with positive edge weights: its Laplacian is the Newton matrix of optimal transport.
struct WeightedGraph {
  struct Edge {
    int a;
    int b;
    double weight;
  };
  int nodes = 0;
  std::vector<Edge> edges;
};

/// Solves Σ_b weight_ab (x_a − x_b) = right_a by a sparse Cholesky factorisation (Eigen's: it
/// brings no multi-threaded BLAS into the process, whose bits would hang on the machine). Parts
/// that do not hang together are held in place by a diagonal of 1e-13 relative to their own.
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

}  // namespace lensforge
