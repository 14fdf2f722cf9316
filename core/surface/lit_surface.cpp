// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/lit_surface.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/optics/front_placement.h"

namespace lensforge {

LightPath light_on(const SurfaceMesh& mesh, const OpticalSetup& setup) {
  const LightPath light(setup);
  return light.intake_is_plan_area() ? light : light.sharing(intake_of(mesh, light));
}

LightPath light_inside(const SurfaceMesh& mesh, const MeshCut& cut, const OpticalSetup& setup) {
  const LightPath light(setup);
  return light.intake_is_plan_area() ? light : light.sharing(intake_inside(mesh, cut, light));
}

double intake_inside(const SurfaceMesh& mesh, const MeshCut& cut, const LightPath& light) {
  double sum = 0.0;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const double share = cut.share[static_cast<std::size_t>(t)];
    if (share > 0.0) sum += share * light.intake(mesh.corners(t));
  }
  return sum;
}

double intake_of(const SurfaceMesh& mesh, const LightPath& light) {
  double sum = 0.0;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) sum += light.intake(mesh.corners(t));
  return sum;
}

double overhang(const SurfaceMesh& mesh, const OpticalSetup& setup) {
  double most = 0.0;
  if (!setup.front) return most;
  for (const Eigen::Vector3d p : mesh.vertices.colwise()) {
    most = std::max(most, overhang(setup, p));
  }
  return most;
}

}  // namespace lensforge
