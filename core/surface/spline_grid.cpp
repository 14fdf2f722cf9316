// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/spline_grid.h"

#include <Eigen/Eigenvalues>

#include "core/surface/cubic_spline.h"

namespace lensforge {

AxisSamples::AxisSamples(const std::vector<double>& at, int knot_cells, double length)
    : cells(knot_cells),
      values(basis_matrix(at, knot_cells, false)),
      slopes(basis_matrix(at, knot_cells, true) * (knot_cells / length)) {}

AxisModes::AxisModes(const AxisSamples& axis) {
  const AxisSamples::Basis mass = axis.values.transpose() * axis.values;
  const AxisSamples::Basis bending = axis.slopes.transpose() * axis.slopes;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver{Eigen::MatrixXd(bending),
                                                                         Eigen::MatrixXd(mass)};
  modes = solver.eigenvectors();
  stiffness = solver.eigenvalues();
}

Eigen::Matrix2d PlanLine::derivative(Eigen::Index j) const {
  Eigen::Matrix2d matrix;
  matrix << by_u.col(j), by_v.col(j);
  return matrix;
}

PlanLine SplineGrid::plan_line(const SplinePlan& plan, std::int64_t i) const {
  PlanLine line{Eigen::Matrix2Xd(2, v.values.rows()), {}, {}};
  line.by_u = line.by_v = line.xy;
  for (Eigen::Index k = 0; k < 2; ++k) {
    const HeightLine part = height_line(plan[static_cast<std::size_t>(k)], i);
    line.xy.row(k) = part.z.transpose();
    line.by_u.row(k) = part.by_u.transpose();
    line.by_v.row(k) = part.by_v.transpose();
  }
  return line;
}

HeightLine SplineGrid::height_line(const Eigen::MatrixXd& heights, std::int64_t i) const {
  const Eigen::VectorXd along = (u.values.row(i) * heights).transpose();
  const Eigen::VectorXd steep = (u.slopes.row(i) * heights).transpose();
  return {v.values * along, v.values * steep, v.slopes * along};
}

}  // namespace lensforge
