// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optimize/grid_preconditioner.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lensforge {

template class GridPreconditionerOn<Executor>;

namespace {

Eigen::VectorXd box_means(const Eigen::VectorXd& values, const GridShape& shape) {
  const auto average = [](const auto& line, auto&& means) {
    const Eigen::Index n = line.size();
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Index begin = std::max<Eigen::Index>(0, i - kLevellingRadius);
      const Eigen::Index end = std::min<Eigen::Index>(n, i + kLevellingRadius + 1);
      means[i] = line.segment(begin, end - begin).mean();
    }
  };
  const auto in = values.reshaped(shape.columns, shape.rows);
  Eigen::MatrixXd along_rows(shape.columns, shape.rows);
  Eigen::MatrixXd means(shape.columns, shape.rows);
  for (int r = 0; r < shape.rows; ++r) average(in.col(r), along_rows.col(r));
  for (int c = 0; c < shape.columns; ++c) average(along_rows.row(c), means.row(c));
  return means.reshaped();
}

}  // namespace

Eigen::ArrayXd levelling_factors(const Eigen::VectorXd& squares, const GridShape& shape) {
  const Eigen::ArrayXd means =
      box_means(squares, shape).array().max(std::numeric_limits<double>::min());
  const Eigen::ArrayXd wanted = -0.25 * means.log();
  const double most = std::log(kMaxLevelling);
  return (wanted - wanted.mean()).max(-most).min(most).exp();
}

}  // namespace lensforge
