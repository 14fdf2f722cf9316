// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/lit_surface.h"

#include <cstdint>

namespace lensforge {

LightPath light_on(const SurfaceMesh& mesh, const OpticalSetup& setup) {
  const LightPath light(setup);
  return light.intake_is_plan_area() ? light : light.sharing(intake_of(mesh, light));
}

double intake_of(const SurfaceMesh& mesh, const LightPath& light) {
  double sum = 0.0;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) sum += light.intake(mesh.corners(t));
  return sum;
}

}  // namespace lensforge
