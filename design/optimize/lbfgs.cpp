// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optimize/lbfgs.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "design/optimize/lbfgs_on.h"

namespace lensforge {

namespace {

Eigen::Map<const Eigen::VectorXd> vector_of(std::span<const double> values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

}  // namespace

LbfgsSummary minimize_lbfgs(const Objective& objective, const Preconditioner& precondition,
                            const LbfgsOptions& options, const LbfgsObserver& observe,
                            const Executor& executor, Eigen::VectorXd& x) {
  Eigen::VectorXd in;
  Eigen::VectorXd out;
  const auto evaluate = [&](std::span<const double> point, std::span<double> gradient) {
    in = vector_of(point);
    const double value = objective(in, out);
    if (std::isfinite(value)) std::copy(out.begin(), out.end(), gradient.begin());
    return value;
  };
  const auto apply = [&](std::span<const double> g, std::span<double> r) {
    in = vector_of(g);
    precondition(in, out);
    std::copy(out.begin(), out.end(), r.begin());
  };
  LbfgsOn<Executor> minimizer(evaluate, apply, options, executor);
  std::vector<double> point(x.begin(), x.end());
  const auto keep = [&] { x = vector_of(point); };
  try {
    LbfgsSummary summary = minimizer.run(observe, point);
    keep();
    return summary;
  } catch (...) {
    keep();
    throw;
  }
}

}  // namespace lensforge
