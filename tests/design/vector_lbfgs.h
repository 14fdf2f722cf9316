// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "design/optimize/lbfgs.h"

namespace lensforge::testing {

using Objective = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>;
using Preconditioner = std::function<void(const Eigen::VectorXd& g, Eigen::VectorXd& r)>;

inline Eigen::Map<const Eigen::VectorXd> vector_of(std::span<const double> values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

/// LbfgsOn on Eigen's vectors. `x` moves from the start to the best point found.
inline LbfgsSummary minimize_lbfgs(const Objective& objective, const Preconditioner& precondition,
                                   const LbfgsOptions& options, const LbfgsObserver& observe,
                                   const Executor& executor, Eigen::VectorXd& x) {
  Eigen::VectorXd out;
  const auto evaluate = [&](std::span<const double> point, std::span<double> gradient) {
    const double value = objective(vector_of(point), out);
    if (std::isfinite(value)) std::copy(out.begin(), out.end(), gradient.begin());
    return value;
  };
  const auto apply = [&](std::span<const double> g, std::span<double> r) {
    precondition(vector_of(g), out);
    std::copy(out.begin(), out.end(), r.begin());
  };
  LbfgsOn<Executor> minimizer(evaluate, apply, options, executor);
  std::vector<double> point(x.begin(), x.end());
  LbfgsSummary summary = minimizer.run(observe, point);
  x = vector_of(point);
  return summary;
}

}  // namespace lensforge::testing
