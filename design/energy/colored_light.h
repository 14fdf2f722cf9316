// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <variant>
#include <vector>

#include "core/optics/light_colors.h"
#include "core/optics/light_path.h"
#include "core/surface/lit_surface.h"
#include "core/surface/mesh_cut.h"
#include "core/surface/surface_mesh.h"
#include "design/energy/objective_options.h"
#include "design/flux/surface_projection.h"

namespace lensforge {

/// The light of one colour, and what is kept of it for every vertex and face.
template <class Exec>
struct ColoredLight {
  LightPath path;  ///< Its flux as shares of all colours' together.
  double share;    ///< Of the brightness.
  typename Exec::template Buffer<IncidentRay> incident;  ///< V; empty in light of one direction.
  typename Exec::template Buffer<double> face_flux;      ///< F; likewise.
};

/// What the whole surface takes of the light, of which an executor holds all faces but for that of
/// design/mpi/, mm². @param cut  by the setup's outline; null without one.
template <class Exec>
double intake_of(const Exec& /*executor*/, const SurfaceMesh& mesh, const MeshCut* cut,
                 const LightPath& light) {
  return cut != nullptr ? intake_inside(mesh, *cut, light) : intake_of(mesh, light);
}

namespace objective_detail {

/// Colours in which a goal is looked at: all of a picture, that of the setup's index of a
/// correspondence.
inline std::vector<LightColor> colors_of(OpticalSetup setup, const DesignGoal& goal) {
  if (!std::holds_alternative<Image>(goal)) setup.spectrum = {};
  return light_colors(setup);
}

/// @param cut  by the setup's outline; null without one.
template <class Exec>
LightPath light_of(const Exec& executor, const LightColor& color, const SurfaceMesh& mesh,
                   const MeshCut* cut) {
  LightPath light(color.setup);
  if (color.share == 1.0 && light.intake_is_plan_area()) return light;
  return light.sharing(intake_of(executor, mesh, cut, light) / color.share);
}

/// @param front  for light_for().
template <class Exec>
std::vector<ColoredLight<Exec>> lights_of(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                          const DesignGoal& goal, const Exec& executor,
                                          typename Exec::template Buffer<double>& front) {
  std::vector<ColoredLight<Exec>> lights;
  for (const LightColor& color : colors_of(setup, goal)) {
    // An outline's is found with its cut.
    const LightPath path =
        setup.outline ? LightPath(color.setup) : light_of(executor, color, mesh, nullptr);
    lights.push_back({light_for(executor, path, front), color.share, {}, {}});
    if (!path.varies()) continue;
    const auto faces = static_cast<std::size_t>(mesh.triangle_count());
    lights.back().face_flux = typename Exec::template Buffer<double>(faces);
  }
  return lights;
}

}  // namespace objective_detail

}  // namespace lensforge
