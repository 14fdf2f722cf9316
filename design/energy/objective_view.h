// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "core/compute/host_device.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "design/energy/aperture.h"
#include "design/energy/area_barrier.h"
#include "design/energy/face_frame.h"
#include "design/energy/mesh_view.h"
#include "design/energy/weights.h"
#include "design/energy/weingarten.h"
#include "design/flux/flux_triangle.h"

/// What the objective's kernels read and write, as raw arrays in the memory of an executor. Handed
/// to them by value.
namespace lensforge {

/// What the surface is shaped after: a picture or a correspondence.
struct GoalView {
  int columns;  ///< Of the picture.
  int rows;
  double parts;  ///< Of a pixel each way, in which the cotangent counts.
  FluxCotangent cotangent;
  const double* target;            ///< Display-encoded, row by row; of a picture.
  const std::int32_t* led;         ///< F, lead_to_unlit_pixels(); null if no facet is led.
  const double* wanted_centroids;  ///< 2 × F, Correspondence::centroids; null for a picture.
  const double* wanted_flux;       ///< F, Correspondence::flux.

  [[nodiscard]] LF_HD double pixels() const { return static_cast<double>(columns) * rows; }
  [[nodiscard]] LF_HD bool is_picture() const { return wanted_centroids == nullptr; }
};

struct FaceBend;

/// What is kept of every face from one kernel to the next.
struct FaceScratch {
  FaceFrame* frames;
  WeingartenMap* maps;
  FaceBend* bends;
  double* edge_weights;  ///< 3 × F, Ψ'(h⁰) of a face's three edges; 0 on the boundary.
  Corners* corner_bar;   ///< Derivatives by every face's corners.
  double* flux;          ///< F, LightPath::flux(); null in light of one direction.
};

/// The vectors of a light path begin at multiples of 16 bytes: with an even number of words before
/// and after it there are no gaps.
struct ObjectiveView {
  ObjectiveWeights weights;
  double nu;         ///< ObjectiveOptions::nu.
  AreaBarrier area;  ///< ObjectiveOptions::area.
  LightPath light;
  const double* vertices;  ///< 3 × V, mm
  VertexRays incident;     ///< On the vertices where they are now.
  MeshView mesh;
  GoalView goal;
  FaceScratch scratch;
  ApertureView aperture;

  [[nodiscard]] LF_HD Corners corners(std::int64_t face) const {
    return mesh.corners(vertices, face);
  }
  [[nodiscard]] LF_HD CornerRays incident_at(std::int64_t face) const {
    return incident.at(mesh.triangle(face));
  }
  /// LightPath::flux() of a face. @pre frames are up to date.
  [[nodiscard]] LF_HD double flux(std::int64_t face) const {
    return scratch.flux != nullptr ? scratch.flux[face] : light.flux(corners(face));
  }
};

}  // namespace lensforge
