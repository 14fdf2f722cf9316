// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/host_device.h"
#include "core/optics/light_path.h"
#include "design/optics/facet.h"
#include "design/optics/image_triangle.h"

/// Smooth model: one ray per vertex, refracted at the vertex normal; image triangles share corners
/// and stretch. It is what a milled and polished part does.
namespace lensforge {

/// Normal of a vertex: the sum of the area normals around it, normalised (area weighting).
struct VertexNormal {
  Eigen::Vector3d n;
  double length;  ///< |sum of area normals|, mm²·2

  LF_HD explicit VertexNormal(const Eigen::Vector3d& area_normal_sum)
      : n(area_normal_sum), length(area_normal_sum.norm()) {
    n *= 1.0 / length;
  }
};

/// Where the ray of a vertex lands, in pixel coordinates. @pre n transmits.
LF_HD inline Eigen::Vector2d project_vertex(const Eigen::Vector3d& p, const Eigen::Vector3d& n,
                                            const LightPath& light,
                                            const IncidentRay* known = nullptr) {
  return light.land(p, light.beam(p, n, known).m);
}

/// Adjoint of project_vertex(): adds to p_bar, returns n_bar.
LF_HD inline Eigen::Vector3d project_vertex_adjoint(
    const Eigen::Vector3d& p, const Eigen::Vector3d& n, const LightPath& light,
    const Eigen::Vector2d& u_bar, Eigen::Vector3d& p_bar, const IncidentRay* known = nullptr) {
  const RefractedBeam beam = light.beam(p, n, known);
  Eigen::Vector2d m_bar(0.0, 0.0);
  light.land_adjoint(p, beam.m, u_bar, p_bar, m_bar);
  return light.beam_adjoint(p, n, beam, m_bar, p_bar, known);
}

}  // namespace lensforge
