// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/fringe.h"

#include <algorithm>
#include <optional>

#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"
#include "core/optics/outline.h"
#include "design/render_spline.h"

namespace lensforge {

Fringe fringe_of(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                 const OpticalSetup& setup) {
  const std::optional<OutlineIndex> outline =
      setup.outline ? std::optional<OutlineIndex>(*setup.outline) : std::nullopt;
  const LightPath first(in_color(setup, setup.spectrum.wavelengths.front()));
  const LightPath last(in_color(setup, setup.spectrum.wavelengths.back()));
  Fringe fringe;
  Eigen::Index count = 0;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector3d p = mesh.vertices.col(v);
    const Eigen::Vector3d n = normals.col(v).normalized();
    if (outline && !outline->contains(p.head<2>())) continue;
    if (!first.transmits(p, n) || !last.transmits(p, n)) continue;
    const Eigen::Vector2d apart =
        first.land(p, first.beam(p, n).m) - last.land(p, last.beam(p, n).m);
    const double mm = apart.cwiseQuotient(first.plane().pixels_per_mm()).norm();
    fringe.mean += mm;
    fringe.max = std::max(fringe.max, mm);
    ++count;
  }
  if (count > 0) fringe.mean /= static_cast<double>(count);
  return fringe;
}

Fringe fringe_of(const Lens& lens) {
  if (lens.model == SurfaceModel::kSpline) {
    const SampledSurface nodes = picture_nodes(*lens.spline);
    return fringe_of(nodes.mesh, nodes.normals, lens.setup);
  }
  return fringe_of(lens.surface, vertex_area_normals(lens.surface), lens.setup);
}

}  // namespace lensforge
