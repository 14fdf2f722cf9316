// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/surface/surface_mesh.h"

namespace lensforge {

/// A mesh in the making, vertex by vertex and triangle by triangle.
class MeshBuilder {
 public:
  [[nodiscard]] std::int64_t vertex_count() const { return std::ssize(points_) / 3; }
  [[nodiscard]] std::int64_t triangle_count() const { return std::ssize(corners_) / 3; }

  /// Rounds the coordinates to single precision.
  void add_vertex(double x, double y, double z) {
    for (const double value : {x, y, z}) {
      points_.push_back(static_cast<double>(static_cast<float>(value)));
    }
  }
  void add_corner(int vertex) { corners_.push_back(vertex); }

  [[nodiscard]] SurfaceMesh mesh() const {
    SurfaceMesh mesh;
    mesh.vertices = Eigen::Map<const Eigen::Matrix3Xd>(points_.data(), 3,
                                                       static_cast<Eigen::Index>(vertex_count()));
    mesh.triangles = Eigen::Map<const Eigen::Matrix3Xi>(
        corners_.data(), 3, static_cast<Eigen::Index>(triangle_count()));
    return mesh;
  }

 private:
  std::vector<double> points_;
  std::vector<int> corners_;
};

/// What to say of a face that is no triangle.
inline std::string corner_problem(std::int64_t face, std::int64_t corners) {
  return "face " + std::to_string(face) + " has " + std::to_string(corners) +
         " corners: only triangles can be read";
}

}  // namespace lensforge
