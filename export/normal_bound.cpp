// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/normal_bound.h"

#include <algorithm>
#include <cmath>

namespace lensforge {
namespace {

double bound_in(const SmoothSurface& surface, Eigen::Index triangle) {
  const SurfaceMesh& mesh = surface.mesh();
  double sum = 0.0;
  double perimeter = 0.0;
  double steepest = 0.0;
  for (int k = 0; k < 3; ++k) {
    const int a = mesh.triangles(k, triangle);
    const int b = mesh.triangles((k + 1) % 3, triangle);
    const Eigen::Vector2d side = (mesh.vertices.col(b) - mesh.vertices.col(a)).head<2>();
    sum += 0.5 * (surface.slopes().col(a) + surface.slopes().col(b)).dot(side);
    perimeter += side.norm();
    steepest = std::max(steepest, surface.slopes().col(a).squaredNorm());
  }
  return std::abs(sum) / perimeter / (1.0 + steepest);
}

}  // namespace

NormalBound normal_bound(const SmoothSurface& surface, double tolerance) {
  const SurfaceMesh& mesh = surface.mesh();
  NormalBound bound;
  double all = 0.0;
  double above = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const double here = bound_in(surface, t);
    const double area = mesh.plan_area(t);
    all += area;
    if (here > tolerance) above += area;
    if (here <= bound.largest) continue;
    bound.largest = here;
    bound.at = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)).head<2>() / 3.0;
  }
  bound.share_above = above / all;
  return bound;
}

}  // namespace lensforge
