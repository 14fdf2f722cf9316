// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/spline_start.h"

#include <cmath>

#include "core/lens/slope_fit.h"
#include "core/lens/smooth_surface.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {
namespace {

constexpr double kPlanStep = 1e-7;
constexpr double kHeightStep = 1e-9;

double rounded(double value, double step) { return std::round(value / step) * step; }

/// The rim exactly on the lens's rectangle.
void clamp_rim(const Eigen::Vector2d& size, ControlNet& net) {
  const Eigen::Index columns = net.shape.columns;
  const Eigen::Index rows = net.shape.rows;
  for (Eigen::Index j = 0; j < rows; ++j) {
    net.points(0, j * columns) = 0.0;
    net.points(0, (j + 1) * columns - 1) = size.x();
  }
  for (Eigen::Index i = 0; i < columns; ++i) {
    net.points(1, i) = 0.0;
    net.points(1, (rows - 1) * columns + i) = size.y();
  }
}

}  // namespace

SurfaceMesh net_mesh(const ControlNet& net) {
  return {net.points, grid_triangles(net.shape), net.shape};
}

ControlNet spline_through(const SurfaceMesh& mesh, const Eigen::Vector2d& size,
                          const GridShape& shape, double share, const Executor& executor,
                          const RunControl& control) {
  const SmoothSurface surface(mesh);
  const GridWarp warp(mesh, surface.box());
  const SlopeFit fit(surface, warp, {shape.columns - 3, shape.rows - 3}, share, executor, control);
  const Eigen::MatrixXd heights = fit.solve();
  ControlNet net{shape, Eigen::Matrix3Xd(3, heights.size())};
  // A table of coefficients has its rows along u, so that it lies in memory as the net does.
  net.points.row(0) = fit.plan()[0].reshaped().transpose();
  net.points.row(1) = fit.plan()[1].reshaped().transpose();
  net.points.row(2) = heights.reshaped().transpose();
  clamp_rim(size, net);
  return net;
}

ControlNet settled(ControlNet net, double thickness) {
  const double lowest = spline_nodes(net, kMeshSamples).mesh.vertices.row(2).minCoeff();
  for (Eigen::Index i = 0; i < net.points.cols(); ++i) {
    const Eigen::Index column = i % net.shape.columns;
    const Eigen::Index row = i / net.shape.columns;
    if (column > 0 && column + 1 < net.shape.columns) {
      net.points(0, i) = rounded(net.points(0, i), kPlanStep);
    }
    if (row > 0 && row + 1 < net.shape.rows) {
      net.points(1, i) = rounded(net.points(1, i), kPlanStep);
    }
    net.points(2, i) = rounded(net.points(2, i) + thickness - lowest, kHeightStep);
  }
  return net;
}

}  // namespace lensforge
