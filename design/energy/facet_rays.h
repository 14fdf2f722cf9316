// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

#include "core/compute/host_device.h"
#include "design/energy/objective_adjoint.h"
#include "design/energy/objective_sums.h"
#include "design/energy/objective_view.h"
#include "design/flux/surface_projection.h"

/// Facet model in the objective: every face sends its light by its own normal.
namespace lensforge {

/// What kernels ask. @pre frames are up to date.
struct FacetRays {
  std::int64_t nothing = 0;  ///< Without it bytes of a kernel's argument would be left unset.

  [[nodiscard]] LF_HD ImageTriangle image(const ObjectiveView& o, std::int64_t face) const {
    const Corners t = o.corners(face);
    const Eigen::Vector3d& n = o.scratch.frames[face].n;
    return land_facet(t, o.light.facet_beam(t, n, o.incident_at(face)), o.light, o.flux(face));
  }

  /// Weighted derivatives of the goal by one face, and its values.
  LF_HD GoalSums pull_back(const ObjectiveView& o, std::int64_t face, const Corners& t,
                           FaceBar& bar) const {
    const Eigen::Vector3d& n = o.scratch.frames[face].n;
    const FacetBeam beam = o.light.facet_beam(t, n, o.incident_at(face));
    const ImageTriangle image = land_facet(t, beam, o.light, o.flux(face));
    ImageTriangle image_bar;
    const GoalSums values = goal_adjoint(o, face, image, image_bar);
    bar.n += project_facet_adjoint(t, n, beam, o.light, image_bar, bar.corners);
    o.light.flux_adjoint(t, image_bar.flux, bar.corners, bar.area_normal, beam.known);
    return values;
  }

  /// Derivative by a vertex that no face carries.
  [[nodiscard]] LF_HD Eigen::Vector3d vertex_bar(std::int64_t /*v*/) const {
    return {0.0, 0.0, 0.0};
  }
};

/// What the objective asks; facets need no arrays of their own.
template <class Exec>
class FacetRaysOn {
 public:
  /// Facets can be led to unlit pixels one by one.
  static constexpr bool kLeadable = true;
  using View = FacetRays;

  FacetRaysOn(std::int64_t /*faces*/, std::int64_t /*vertices*/) {}

  [[nodiscard]] FacetRays view(std::size_t /*color*/) { return {}; }

  /// Follows the rays to the screen; false where one is not let out.
  [[nodiscard]] bool land(const Exec& /*executor*/, const ObjectiveView& /*o*/,
                          std::size_t /*color*/) {
    return true;
  }

  /// Goes back from the goal to what FacetRays::pull_back() needs; the goal's values as far as that
  /// does not return them.
  [[nodiscard]] auto pull_back(const Exec& /*executor*/, const ObjectiveView& /*o*/,
                               std::size_t /*color*/) {
    return typename Exec::template PendingSum<4>();
  }

  /// Facets have no normals of their own.
  void add_normal_bar(const Exec& /*executor*/, double* /*sum*/) {}
};

}  // namespace lensforge
