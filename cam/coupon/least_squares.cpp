// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/least_squares.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace lensforge {
namespace {

constexpr int kMostSteps = 200;
constexpr double kSlightest = 1e-14;  ///< Share of the sum that is no progress: rounding.
constexpr double kFirstDamping = 1e-3;
constexpr double kMostDamping = 1e10;  ///< Steps are shorter than differences there.
constexpr double kEasing = 10.0;

/// Least eigenvalue of JᵀJ, its columns scaled to length 1, that counts: differences are exact to
/// about 1e-8.
constexpr double kSingular = 1e-12;

/// Of a datum that alone determines something: others say nothing of it.
constexpr double kAlone = 1e-6;

struct Normal {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd scale;    ///< Lengths of the jacobian's columns, 1 for columns of zeros.
  Eigen::MatrixXd inverse;  ///< Of JᵀJ.
};

Normal normal_of(const LeastSquares& problem, const Eigen::VectorXd& parameters) {
  Normal normal;
  normal.jacobian = problem.jacobian(parameters);
  normal.scale = normal.jacobian.colwise().norm().transpose();
  for (double& length : normal.scale) length = length > 0.0 ? length : 1.0;
  const Eigen::MatrixXd unit = normal.jacobian * normal.scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(unit.transpose() * unit);
  const Eigen::VectorXd values = solver.eigenvalues().cwiseMax(kSingular);
  const Eigen::MatrixXd half = normal.scale.cwiseInverse().asDiagonal() * solver.eigenvectors() *
                               values.cwiseSqrt().cwiseInverse().asDiagonal();
  normal.inverse = half * half.transpose();
  return normal;
}

/// A damped step, no longer than it may be.
Eigen::VectorXd step_of(const LeastSquares& problem, const Eigen::MatrixXd& jacobian,
                        const Eigen::VectorXd& residuals, double damping) {
  Eigen::MatrixXd matrix = jacobian.transpose() * jacobian;
  const double floor = kSingular * std::max(matrix.diagonal().maxCoeff(), 1e-300);
  matrix.diagonal() += damping * matrix.diagonal().cwiseMax(floor);
  Eigen::VectorXd step = -matrix.ldlt().solve(jacobian.transpose() * residuals);
  double longest = 1.0;
  for (Eigen::Index i = 0; i < step.size(); ++i) {
    longest = std::max(
        longest, std::abs(step[i]) / problem.longest[problem.free[static_cast<std::size_t>(i)]]);
  }
  return step / longest;
}

}  // namespace

Eigen::MatrixXd LeastSquares::jacobian(const Eigen::VectorXd& parameters) const {
  Eigen::MatrixXd columns;
  for (std::size_t i = 0; i < free.size(); ++i) {
    Eigen::VectorXd moved = parameters;
    const double step = steps[free[i]];
    moved[free[i]] = parameters[free[i]] + step;
    const Eigen::VectorXd above = residuals(moved);
    moved[free[i]] = parameters[free[i]] - step;
    const Eigen::VectorXd below = residuals(moved);
    columns.conservativeResize(above.size(), static_cast<Eigen::Index>(free.size()));
    columns.col(static_cast<Eigen::Index>(i)) = (above - below) / (2.0 * step);
  }
  return columns;
}

Eigen::VectorXd minimize(const LeastSquares& problem, Eigen::VectorXd start) {
  if (problem.free.empty()) return start;
  Eigen::VectorXd at = std::move(start);
  Eigen::VectorXd residuals = problem.residuals(at);
  double damping = kFirstDamping;
  for (int k = 0; k < kMostSteps && damping < kMostDamping; ++k) {
    const Eigen::MatrixXd jacobian = problem.jacobian(at);
    const double before = residuals.squaredNorm();
    for (; damping < kMostDamping; damping *= kEasing) {
      const Eigen::VectorXd step = step_of(problem, jacobian, residuals, damping);
      Eigen::VectorXd tried = at;
      for (std::size_t i = 0; i < problem.free.size(); ++i) {
        tried[problem.free[i]] += step[static_cast<Eigen::Index>(i)];
      }
      const Eigen::VectorXd now = problem.residuals(tried);
      if (!(now.squaredNorm() < before)) continue;
      at = tried;
      residuals = now;
      damping /= kEasing;
      break;
    }
    if (before - residuals.squaredNorm() <= kSlightest * before) break;
  }
  return at;
}

FitQuality fit_quality(const LeastSquares& problem, const Eigen::VectorXd& minimum) {
  const Eigen::VectorXd residuals = problem.residuals(minimum);
  if (problem.free.empty()) return {{}, residuals};
  const Normal normal = normal_of(problem, minimum);
  FitQuality quality;
  quality.uncertainties = normal.inverse.diagonal().cwiseSqrt();
  quality.deletion = residuals;
  for (Eigen::Index i = 0; i < residuals.size(); ++i) {
    const Eigen::RowVectorXd row = normal.jacobian.row(i);
    const double rest = 1.0 - row * normal.inverse * row.transpose();
    quality.deletion[i] = rest > kAlone ? residuals[i] / std::sqrt(rest) : 0.0;
  }
  return quality;
}

}  // namespace lensforge
