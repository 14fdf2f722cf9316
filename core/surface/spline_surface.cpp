// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/spline_surface.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace lensforge {
namespace {

void widen(BendRange& range, const Eigen::Matrix2d& bend) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
  solver.computeDirect(bend, Eigen::EigenvaluesOnly);
  range.least = std::min(range.least, solver.eigenvalues()[0]);
  range.largest = std::max(range.largest, solver.eigenvalues()[1]);
}

}  // namespace

SplineSurface::SplineSurface(ControlNet net)
    : OpticalSurface(spline_nodes(net, kMeshSamples).mesh), net_(std::move(net)) {}

Eigen::Vector2d SplineSurface::node_parameters(int node) const {
  const int columns = mesh().grid.columns;
  return Eigen::Vector2d(node % columns, node / columns) / kMeshSamples;
}

SurfaceShape SplineSurface::shape_in(std::int64_t triangle, const Eigen::Vector3d& weights) const {
  Eigen::Vector2d xy(0.0, 0.0);
  Eigen::Vector2d start(0.0, 0.0);
  for (int k = 0; k < 3; ++k) {
    xy += weights[k] * mesh().corner(triangle, k).head<2>();
    start += weights[k] * node_parameters(mesh().triangles(k, triangle));
  }
  return net_.at(net_.parameters_of(xy, start)).shape();
}

SurfacePoint SplineSurface::in_triangle(std::int64_t triangle,
                                        const Eigen::Vector3d& weights) const {
  const SurfaceShape shape = shape_in(triangle, weights);
  return {shape.z, shape.slope};
}

SmoothPatch SplineSurface::patch_in(std::int64_t triangle,
                                    const Eigen::Vector3d& /*weights*/) const {
  std::array<Eigen::Vector2d, 3> p;
  std::array<SurfaceShape, 3> s;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    p[i] = mesh().corner(triangle, k).head<2>();
    s[i] = net_.at(node_parameters(mesh().triangles(k, triangle))).shape();
  }
  const auto toward = [&](std::size_t i, std::size_t j) {
    return s[i].z + s[i].slope.dot(p[j] - p[i]) / 3.0;
  };
  SmoothPatch::Coefficients c{s[0].z,       s[1].z,       s[2].z, toward(0, 1), toward(1, 0),
                              toward(0, 2), toward(1, 2), 0.0,    toward(2, 0), toward(2, 1)};
  // In the middle a corner weighs 1/27, a coefficient on an edge 3/27, the inner one 6/27.
  const double middle = shape_in(triangle, Eigen::Vector3d::Constant(1.0 / 3.0)).z;
  const double corners = c[0] + c[1] + c[2];
  const double edges = c[3] + c[4] + c[5] + c[6] + c[8] + c[9];
  c[7] = (27.0 * middle - corners - 3.0 * edges) / 6.0;
  return {p, c};
}

BendRange SplineSurface::bend_range(std::int64_t triangle) const {
  const SmoothPatch patch = patch_in(triangle, Eigen::Vector3d::Constant(1.0 / 3.0));
  BendRange range{HUGE_VAL, -HUGE_VAL};
  for (int k = 0; k < 3; ++k) {
    widen(range, patch.at(mesh().corner(triangle, k).head<2>()).bend);
    widen(range, net_.at(node_parameters(mesh().triangles(k, triangle))).shape().bend);
  }
  return range;
}

}  // namespace lensforge
