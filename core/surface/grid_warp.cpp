// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/grid_warp.h"

#include <algorithm>
#include <cmath>

#include "core/surface/cubic_spline.h"
#include "core/surface/grid_layout.h"

namespace lensforge {
namespace {

/// x and y of control points are rounded to multiples of this (mm), which keeps files short;
/// heights are fitted to the rounded points.
constexpr double kPlanStep = 1e-5;

double rounded(double value) { return std::round(value / kPlanStep) * kPlanStep; }

}  // namespace

GridWarp::GridWarp(const SurfaceMesh& mesh, const Eigen::AlignedBox2d& box)
    : mesh_(mesh), box_(box) {
  const GridShape& grid = mesh.grid;
  moves_ = grid.columns > 1 && grid.rows > 1 &&
           Eigen::Index{grid.columns} * grid.rows == mesh.vertices.cols() && borders_hold();
}

bool GridWarp::borders_hold() const {
  constexpr double kOnBorder = 1e-9;  // mm
  const int last_column = mesh_.grid.columns - 1;
  const int last_row = mesh_.grid.rows - 1;
  for (Eigen::Index i = 0; i < mesh_.vertices.cols(); ++i) {
    const Eigen::Index column = i % mesh_.grid.columns;
    const Eigen::Index row = i / mesh_.grid.columns;
    const Eigen::Array2d off = (mesh_.vertices.col(i).head<2>() - rest(i)).array().abs();
    if ((column == 0 || column == last_column) && off.x() > kOnBorder) return false;
    if ((row == 0 || row == last_row) && off.y() > kOnBorder) return false;
  }
  return true;
}

Eigen::Vector2d GridWarp::rest(Eigen::Index vertex) const {
  const int cells_u = mesh_.grid.columns - 1;
  const auto column = static_cast<int>(vertex % mesh_.grid.columns);
  const auto row = static_cast<int>(vertex / mesh_.grid.columns);
  const Eigen::Array2d share(rest_column(column, row, cells_u) / cells_u,
                             static_cast<double>(row) / (mesh_.grid.rows - 1));
  return box_.min() + (share * box_.sizes().array()).matrix();
}

Eigen::Vector2d GridWarp::before(Eigen::Index vertex) const {
  return moves_ ? rest(vertex) : Eigen::Vector2d(mesh_.vertices.col(vertex).head<2>());
}

Eigen::Vector2d GridWarp::displacement(double column, int row) const {
  const RowPosition p = locate_in_row(column, row, mesh_.grid.columns - 1);
  const Eigen::Index i = Eigen::Index{row} * mesh_.grid.columns + p.column;
  return (1.0 - p.fraction) * (mesh_.vertices.col(i).head<2>() - rest(i)) +
         p.fraction * (mesh_.vertices.col(i + 1).head<2>() - rest(i + 1));
}

Eigen::Vector2d GridWarp::at(const Eigen::Vector2d& uv) const {
  if (!moves_) return uv;
  const Eigen::Array2d share = (uv - box_.min()).array() / box_.sizes().array();
  const double column = share.x() * (mesh_.grid.columns - 1);
  const double along = share.y() * (mesh_.grid.rows - 1);
  const int row = std::clamp(static_cast<int>(along), 0, mesh_.grid.rows - 2);
  const double t = along - row;
  return uv + (1.0 - t) * displacement(column, row) + t * displacement(column, row + 1);
}

std::array<Eigen::MatrixXd, 2> GridWarp::control_points(int cells_u, int cells_v,
                                                        double share) const {
  std::array<Eigen::MatrixXd, 2> points;
  for (Eigen::MatrixXd& part : points) part.resize(cells_u + 3, cells_v + 3);
  for (Eigen::Index j = 0; j < cells_v + 3; ++j) {
    for (Eigen::Index i = 0; i < cells_u + 3; ++i) {
      const Eigen::Array2d place(greville_point(static_cast<int>(i), cells_u) / cells_u,
                                 greville_point(static_cast<int>(j), cells_v) / cells_v);
      const Eigen::Vector2d even = box_.min() + (place * box_.sizes().array()).matrix();
      const Eigen::Vector2d xy = even + share * (at(even) - even);
      points[0](i, j) = i == 0 || i == cells_u + 2 ? even.x() : rounded(xy.x());
      points[1](i, j) = j == 0 || j == cells_v + 2 ? even.y() : rounded(xy.y());
    }
  }
  return points;
}

}  // namespace lensforge
