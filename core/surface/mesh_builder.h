// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Builds a mesh vertex by vertex and face by face.
class MeshBuilder {
 public:
  [[nodiscard]] std::int64_t vertex_count() const { return std::ssize(points_) / 3; }
  [[nodiscard]] std::int64_t face_count() const { return faces_; }

  /// Rounds the coordinates to single precision.
  void add_vertex(double x, double y, double z);

  /// A polygon; its vertices may follow later. @pre corners.size() ≥ 3
  void add_face(std::span<const int> corners);

  /// The mesh with polygons cut by polygon_triangles(). Polygons with indices out of range or
  /// vertices that are not finite become fans.
  [[nodiscard]] SurfaceMesh mesh() const;

 private:
  /// A face with more than three corners, stored as a fan in `triangles_`.
  struct Polygon {
    std::int64_t first = 0;  ///< Triangle.
    std::int64_t corners = 0;
  };

  void cut(const Polygon& polygon, SurfaceMesh& mesh) const;

  std::vector<double> points_;
  std::vector<int> triangles_;
  std::vector<Polygon> polygons_;
  std::int64_t faces_ = 0;
};

/// Message about a face that is no polygon.
inline std::string corner_problem(std::int64_t face, std::int64_t corners) {
  return "face " + std::to_string(face) + " has " + std::to_string(corners) +
         " corners: it must have 3 at least";
}

}  // namespace lensforge
