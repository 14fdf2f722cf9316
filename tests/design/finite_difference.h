// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>

namespace lensforge::testing {

using Scalar = std::function<double(const Eigen::VectorXd&)>;

/// Slope of f at x along `direction` by central differences of fourth order.
inline double directional_slope(const Scalar& f, const Eigen::VectorXd& x,
                                const Eigen::VectorXd& direction, double step) {
  const Eigen::VectorXd d = step * direction;
  const double near = f(x + d) - f(x - d);
  const double far = f(x + 2.0 * d) - f(x - 2.0 * d);
  return (8.0 * near - far) / (12.0 * step);
}

/// All slopes of f at x.
inline Eigen::VectorXd numeric_gradient(const Scalar& f, const Eigen::VectorXd& x, double step) {
  Eigen::VectorXd gradient(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    gradient[i] = directional_slope(f, x, Eigen::VectorXd::Unit(x.size(), i), step);
  }
  return gradient;
}

/// Largest difference of two gradients, relative to the largest entry.
inline double gradient_error(const Eigen::VectorXd& computed, const Eigen::VectorXd& expected) {
  return (computed - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

}  // namespace lensforge::testing
