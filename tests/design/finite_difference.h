// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <vector>

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

/// Error of `computed` against central differences with `step` and with half of it, the larger of
/// the two: one step alone may agree by chance, where truncation and rounding cancel.
inline double plateau_error(const Eigen::VectorXd& computed, const Scalar& f,
                            const Eigen::VectorXd& x, double step) {
  return std::max(gradient_error(computed, numeric_gradient(f, x, step)),
                  gradient_error(computed, numeric_gradient(f, x, 0.5 * step)));
}

/// Smallest error that two neighbouring steps both keep, of errors in the order of their steps; for
/// functions with kinks, where the right size of the step is not known beforehand.
inline double plateau_error(const std::vector<double>& errors) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < errors.size(); ++k) {
    best = std::min(best, std::max(errors[k - 1], errors[k]));
  }
  return best;
}

/// Steps that suit the objectives: large ones cross corners of pixels, small ones drown in
/// rounding.
inline const std::vector<double> kObjectiveSteps{1e-4, 1e-5, 2e-6, 5e-7, 1e-7};

/// Error, by plateau_error(), of a gradient along a direction, relative to the slope or, where its
/// terms cancel, to their norm.
inline double slope_error(const Scalar& f, const Eigen::VectorXd& x,
                          const Eigen::VectorXd& gradient, const Eigen::VectorXd& direction,
                          const std::vector<double>& steps = kObjectiveSteps) {
  const Eigen::VectorXd products = gradient.cwiseProduct(direction);
  const double expected = products.sum();
  const double scale = std::max(std::fabs(expected), products.norm());
  std::vector<double> errors;
  errors.reserve(steps.size());
  for (const double step : steps) {
    errors.push_back(std::fabs(directional_slope(f, x, direction, step) - expected) / scale);
  }
  return plateau_error(errors);
}

}  // namespace lensforge::testing
