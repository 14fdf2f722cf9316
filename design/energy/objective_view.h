// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/outline.h"
#include "design/energy/objective_options.h"
#include "design/flux/columns.h"
#include "design/flux/flux_triangle.h"
#include "design/flux/surface_projection.h"

namespace lensforge {

/// Connectivity of a mesh as raw arrays in the memory of an executor; see MeshTopology.
struct MeshView {
  const int* triangles = nullptr;   ///< 3 × T
  const int* neighbours = nullptr;  ///< 3 × T; −1 at the boundary.
  const std::int32_t* vertex_corner_begin = nullptr;
  const std::int32_t* vertex_corners = nullptr;
  const std::int32_t* vertex_neighbour_begin = nullptr;
  const std::int32_t* vertex_neighbours = nullptr;
  const std::uint8_t* on_boundary = nullptr;
  std::int64_t faces = 0;
  std::int64_t vertices = 0;

  [[nodiscard]] LF_HD const int* triangle(std::int64_t face) const { return triangles + 3 * face; }
  [[nodiscard]] LF_HD int neighbour(std::int64_t face, int k) const {
    return neighbours[3 * face + k];
  }
  /// The edge that a face shares with its neighbour `other`.
  [[nodiscard]] LF_HD int edge_to(std::int64_t face, std::int64_t other) const {
    return neighbour(face, 0) == other ? 0 : (neighbour(face, 1) == other ? 1 : 2);
  }
  /// Corners of a face, given all vertices (3 × V).
  [[nodiscard]] LF_HD Corners corners(const double* positions, std::int64_t face) const {
    return corners_at(triangle(face), positions);
  }
};

/// Owns the arrays of a MeshView.
template <class Exec>
class MeshOn {
 public:
  MeshOn(const SurfaceMesh& mesh, const MeshTopology& topology, const Exec& executor)
      : triangles_(buffer_of(executor, entries(mesh.triangles))),
        neighbours_(buffer_of(executor, entries(topology.neighbours))),
        vertex_corner_begin_(buffer_of(executor, std::span(topology.vertex_corner_begin))),
        vertex_corners_(buffer_of(executor, std::span(topology.vertex_corners))),
        vertex_neighbour_begin_(buffer_of(executor, std::span(topology.vertex_neighbour_begin))),
        vertex_neighbours_(buffer_of(executor, std::span(topology.vertex_neighbours))),
        on_boundary_(buffer_of(executor, std::span(topology.on_boundary))),
        faces_(mesh.triangle_count()),
        vertices_(mesh.vertex_count()) {}

  [[nodiscard]] MeshView view() const {
    return {triangles_.data(),
            neighbours_.data(),
            vertex_corner_begin_.data(),
            vertex_corners_.data(),
            vertex_neighbour_begin_.data(),
            vertex_neighbours_.data(),
            on_boundary_.data(),
            faces_,
            vertices_};
  }

 private:
  template <class T>
  using Buffer = typename Exec::template Buffer<T>;

  static std::span<const int> entries(const Eigen::Matrix3Xi& matrix) {
    return {matrix.data(), static_cast<std::size_t>(matrix.size())};
  }

  Buffer<int> triangles_;
  Buffer<int> neighbours_;
  Buffer<std::int32_t> vertex_corner_begin_;
  Buffer<std::int32_t> vertex_corners_;
  Buffer<std::int32_t> vertex_neighbour_begin_;
  Buffer<std::int32_t> vertex_neighbours_;
  Buffer<std::uint8_t> on_boundary_;
  std::int64_t faces_;
  std::int64_t vertices_;
};

// A lens's outline in the objective. Faces that it cuts keep their corners' x and y, so their parts
// inside stay the same triangles until the next relinearize(). A face's light lands by an affine
// map: each part's image is exact and its derivative a weighted sum.

/// Parts of the faces inside an outline: MeshCut in the memory of an executor.
struct ApertureView {
  const std::int32_t* first = nullptr;  ///< F; null without an outline.
  const MeshCut::Piece* pieces = nullptr;
  const double* shares = nullptr;  ///< F
  std::int64_t count = 0;          ///< Number of pieces that belong to a face.

  [[nodiscard]] LF_HD bool is_whole(std::int64_t face) const {
    return first == nullptr || first[face] == MeshCut::kWhole;
  }
  [[nodiscard]] LF_HD double share(std::int64_t face) const {
    return first == nullptr ? 1.0 : shares[face];
  }
};

/// Owns the arrays of an ApertureView.
template <class Exec>
class ApertureOn {
 public:
  /// No outline.
  ApertureOn() = default;
  ApertureOn(const MeshCut& cut, const Exec& executor)
      : first_(buffer_of(executor, std::span(cut.first))),
        pieces_(buffer_of(executor, std::span(cut.pieces))),
        shares_(buffer_of(executor, std::span(cut.share))) {}

  [[nodiscard]] ApertureView view() const {
    if (first_.size() == 0) return {};
    return {first_.data(), pieces_.data(), shares_.data(),
            static_cast<std::int64_t>(pieces_.size()) - 1};
  }

 private:
  template <class T>
  using Buffer = typename Exec::template Buffer<T>;

  Buffer<std::int32_t> first_;
  Buffer<MeshCut::Piece> pieces_;
  Buffer<double> shares_;
};

/// Holds x and y of the corners of faces that an outline cuts. @param movable  3 × V, 1 or 0.
inline void hold_rim(const SurfaceMesh& mesh, const MeshCut& cut, Eigen::Matrix3Xd& movable) {
  for (std::int64_t k = 0; k + 1 < std::ssize(cut.pieces); ++k) {
    for (const int v : mesh.triangles.col(cut.pieces[static_cast<std::size_t>(k)].face)) {
      movable.col(v).head<2>().setZero();
    }
  }
}

// Values of the objective's terms that are summed over faces. Executors sum arrays: packed() and
// of() convert.

/// Values of the goal's terms, for one face or all.
struct GoalSums {
  using Packed = std::array<double, 4>;

  double boundary = 0.0;
  double unlit = 0.0;
  double align = 0.0;
  double flux = 0.0;

  [[nodiscard]] LF_HD Packed packed() const { return {boundary, unlit, align, flux}; }
  [[nodiscard]] static GoalSums of(const Packed& p) { return {p[0], p[1], p[2], p[3]}; }

  LF_HD GoalSums& operator+=(const GoalSums& other) {
    boundary += other.boundary;
    unlit += other.unlit;
    align += other.align;
    flux += other.flux;
    return *this;
  }
};

/// Values of the goal's terms and the barrier.
struct FaceSums {
  using Packed = std::array<double, 5>;

  GoalSums goal;
  double barrier = 0.0;

  [[nodiscard]] LF_HD Packed packed() const {
    return {goal.boundary, goal.unlit, goal.align, goal.flux, barrier};
  }
  [[nodiscard]] static FaceSums of(const Packed& p) { return {{p[0], p[1], p[2], p[3]}, p[4]}; }
};

// Arguments of the objective's kernels, passed by value: raw arrays in the memory of an executor.

/// The goal: a picture or a correspondence.
struct GoalView {
  int columns;  ///< Columns of the picture.
  int rows;
  double parts;  ///< Parts of a pixel each way, in which the cotangent is stored.
  FluxCotangent cotangent;
  const double* target;            ///< Display-encoded, row by row; for a picture.
  const std::int32_t* led;         ///< F, lead_to_unlit_pixels(); null if no facet is led.
  const double* wanted_centroids;  ///< 2 × F, Correspondence::centroids; null for a picture.
  const double* wanted_flux;       ///< F, Correspondence::flux.

  [[nodiscard]] LF_HD double pixels() const { return static_cast<double>(columns) * rows; }
  [[nodiscard]] LF_HD bool is_picture() const { return wanted_centroids == nullptr; }
};

struct FaceBend;
template <class T>
struct FaceFrameOf;
using FaceFrame = FaceFrameOf<double>;
template <class T>
struct WeingartenMapOf;
using WeingartenMap = WeingartenMapOf<double>;

/// Values per face that one kernel leaves for the next.
struct FaceScratch {
  FaceFrame* frames;      ///< Null without smoothness terms, but for facets.
  double* doubled_areas;  ///< F, mm²
  WeingartenMap* maps;
  FaceBend* bends;
  double* edge_weights;  ///< 3 × F, Ψ'(h⁰) of a face's three edges; 0 on the boundary.
  Corners* corner_bar;   ///< Derivatives by every face's corners.
  double* flux;          ///< F, LightPath::flux(); null in light of one direction.
};

/// State of the objective for its kernels. The vectors of a light path are aligned to 16 bytes:
/// with an even number of words before and after it there are no gaps.
struct ObjectiveView {
  ObjectiveWeights weights;
  double nu;         ///< ObjectiveOptions::nu.
  AreaBarrier area;  ///< ObjectiveOptions::area.
  LightPath light;
  const double* vertices;  ///< 3 × V, mm
  VertexRays incident;     ///< Rays to the vertices at their current places.
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
  /// LightPath::flux() of a face. @pre MeasureFace was called for it.
  [[nodiscard]] LF_HD double flux(std::int64_t face) const {
    return scratch.flux != nullptr ? scratch.flux[face] : light.flux(corners(face));
  }
};

}  // namespace lensforge
