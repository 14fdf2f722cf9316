// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/solid_geometry.h"

#include <cmath>

namespace lensforge {

TColStd_Array1OfReal even_knots(double from, double to, int cells) {
  TColStd_Array1OfReal result(1, cells + 1);
  for (int i = 0; i <= cells; ++i) result(i + 1) = from + (to - from) * i / cells;
  return result;
}

TColStd_Array1OfInteger clamped_multiplicities(int cells) {
  TColStd_Array1OfInteger result(1, cells + 1);
  result.Init(1);
  result(1) = kSplineDegree + 1;
  result(cells + 1) = kSplineDegree + 1;
  return result;
}

Handle(Geom_BSplineSurface) surface_of(const SplinePatch& patch) {
  const int m = patch.cells_u;
  const int n = patch.cells_v;
  const Eigen::Vector2d low = patch.box.min();
  const Eigen::Vector2d high = patch.box.max();
  TColgp_Array2OfPnt poles(1, m + kSplineDegree, 1, n + kSplineDegree);
  const auto& [x, y, z] = patch.coefficients;
  for (int i = 0; i < m + kSplineDegree; ++i) {
    for (int j = 0; j < n + kSplineDegree; ++j) {
      poles(i + 1, j + 1) = gp_Pnt(x(i, j), y(i, j), z(i, j));
    }
  }
  return new Geom_BSplineSurface(poles, even_knots(low.x(), high.x(), m),
                                 even_knots(low.y(), high.y(), n), clamped_multiplicities(m),
                                 clamped_multiplicities(n), kSplineDegree, kSplineDegree);
}

gp_Sphere sphere_of(const SphericalFront& front) {
  const gp_Pnt centre(front.apex.x(), front.apex.y(), front.apex.z() + front.radius);
  const gp_Dir away(0.0, 0.0, front.radius);
  return {gp_Ax3(centre, gp_Dir(0.0, 1.0, 0.0), away), std::abs(front.radius)};
}

}  // namespace lensforge
