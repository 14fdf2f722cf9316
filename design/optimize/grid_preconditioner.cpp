// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optimize/grid_preconditioner.h"

#include <cstddef>

namespace lensforge {

template class GridPreconditionerOn<Executor>;

void GridPreconditioner::apply_power(const Eigen::VectorXd& g, double exponent,
                                     Eigen::VectorXd& r) {
  r.resize(g.size());
  const auto size = static_cast<std::size_t>(g.size());
  GridPreconditionerOn<Executor>::apply({g.data(), size}, exponent, {r.data(), size});
}

}  // namespace lensforge
