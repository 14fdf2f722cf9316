// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace lensforge {

/// A weighted least-squares problem in a few parameters: find the least |r(p)|².
struct LeastSquares {
  std::function<Eigen::VectorXd(const Eigen::VectorXd& parameters)> residuals;
  std::vector<int> free;    ///< Parameters that may change; the others keep their value.
  Eigen::VectorXd steps;    ///< Of differences, one a parameter, > 0.
  Eigen::VectorXd longest;  ///< Change of a parameter in one step at most.

  /// ∂r/∂p of the free parameters, by central differences.
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::VectorXd& parameters) const;
};

/// What the fit is worth at its minimum, with residuals of standard deviation 1.
struct FitQuality {
  /// Standard uncertainty of each free parameter, √ of the diagonal of (JᵀJ)⁻¹; enormous for what
  /// the residuals do not determine.
  Eigen::VectorXd uncertainties;
  /// By how many standard deviations each residual's datum is off what the others say of it:
  /// r / √(1 − h), h the diagonal of J(JᵀJ)⁻¹Jᵀ (Belsley, Kuh, Welsch, "Regression Diagnostics",
  /// 1980). 0 for a datum that others say nothing of.
  Eigen::VectorXd deletion;
};

/// Levenberg-Marquardt steps (Marquardt 1963) from `start` until none lowers the sum by a part in
/// 1e14.
Eigen::VectorXd minimize(const LeastSquares& problem, Eigen::VectorXd start);

FitQuality fit_quality(const LeastSquares& problem, const Eigen::VectorXd& minimum);

}  // namespace lensforge
