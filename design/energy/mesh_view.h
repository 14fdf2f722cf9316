// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/surface/mesh_topology.h"
#include "core/surface/surface_mesh.h"
#include "design/flux/columns.h"

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
  /// The edge by which a face borders on another.
  [[nodiscard]] LF_HD int edge_to(std::int64_t face, std::int64_t other) const {
    return neighbour(face, 0) == other ? 0 : (neighbour(face, 1) == other ? 1 : 2);
  }
  /// Corners of a face, given all vertices (3 × V).
  [[nodiscard]] LF_HD Corners corners(const double* positions, std::int64_t face) const {
    return corners_at(triangle(face), positions);
  }
};

/// The arrays behind a MeshView.
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

}  // namespace lensforge
