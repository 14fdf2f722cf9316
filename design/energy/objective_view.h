// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "core/compute/host_device.h"
#include "core/optics/light_path.h"
#include "design/energy/correspondence_term.h"
#include "design/energy/face_frame.h"
#include "design/energy/mesh_view.h"
#include "design/energy/objective_options.h"
#include "design/energy/unlit_pixels.h"
#include "design/energy/weingarten.h"
#include "design/flux/flux_triangle.h"
#include "design/optics/facet.h"

namespace lensforge {

/// Everything that the objective's kernels read and write, as raw arrays in the memory of an
/// executor. Handed to them by value.
struct ObjectiveView {
  ObjectiveOptions options;
  LightPath light;
  MeshView mesh;
  const double* vertices;  ///< 3 × V, mm

  double columns;  ///< Of the picture.
  double rows;
  FluxCotangent cotangent;
  const double* wanted_centroids;  ///< 2 × F, Correspondence::centroids; null for a picture.
  const double* wanted_flux;       ///< F, Correspondence::flux.
  const double* target;            ///< Display-encoded, row by row; of a picture.
  const std::int32_t* led;         ///< F, lead_to_unlit_pixels(); null if no facet is led.

  FaceFrame* frames;
  WeingartenMap* maps;
  double* edge_weights;  ///< 3 × F, Ψ'(h⁰) of a face's three edges; 0 on the boundary.
  Corners* corner_bar;   ///< Derivatives by every face's corners.

  // Smooth model only.
  double* vertex_normals;  ///< 3 × V, sums of area normals.
  double* landing;         ///< 2 × V, pixel coordinates.
  ImageTriangle* triangle_bar;
  double* vertex_bar;         ///< 3 × V, direct derivative by position.
  double* vertex_normal_bar;  ///< 3 × V, derivative by the sum of area normals.

  [[nodiscard]] LF_HD Corners corners(std::int64_t face) const {
    return mesh.corners(vertices, face);
  }
  [[nodiscard]] LF_HD bool facets() const { return options.model == SurfaceModel::kFacet; }

  /// What a face throws onto the receiving plane. @pre frames, or landing, are up to date.
  [[nodiscard]] LF_HD ImageTriangle image_triangle(std::int64_t face) const {
    const Corners t = corners(face);
    if (facets()) {
      return project_facet(t, light.facet_beam(t, frames[face].n), light);
    }
    const int* v = mesh.triangle(face);
    return {column2(landing, v[0]), column2(landing, v[1]), column2(landing, v[2]), light.flux(t)};
  }
};

/// image_triangle() as a source of FluxImageOn::render().
struct FaceLightSource {
  ObjectiveView o;
  LF_HD ImageTriangle operator()(std::int64_t face) const { return o.image_triangle(face); }
};

}  // namespace lensforge
