// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

namespace lensforge {

/// Least-squares fits by cubic B-splines over [0, cells] whose first two and last two coefficients
/// are given (value and slope at the ends). The matrices depend on `cells` only.
class LineFit {
 public:
  /// @pre cells ≥ 2.
  explicit LineFit(int cells);

  [[nodiscard]] int cells() const { return cells_; }
  /// Where samples are taken: kSamples a cell and the end.
  [[nodiscard]] const std::vector<double>& points() const { return points_; }

  /// @param ends  cells + 3 coefficients; the inner ones are replaced by the fit to `samples`.
  [[nodiscard]] Eigen::VectorXd fit(const Eigen::VectorXd& samples, Eigen::VectorXd ends) const;

  /// The same for a tensor product: `rim` gives the two outer rings of coefficients.
  [[nodiscard]] Eigen::MatrixXd fit(const Eigen::MatrixXd& samples, Eigen::MatrixXd rim) const;

 private:
  using Basis = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  int cells_;
  std::vector<double> points_;
  Basis basis_;                   ///< Samples × (cells + 3).
  Eigen::MatrixXd inner_solver_;  ///< Inverse of the inner functions' normal matrix.
};

}  // namespace lensforge
