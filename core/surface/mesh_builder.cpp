// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/mesh_builder.h"

#include <algorithm>

#include "core/surface/polygon.h"

namespace lensforge {

void MeshBuilder::add_vertex(double x, double y, double z) {
  for (const double value : {x, y, z}) {
    points_.push_back(static_cast<double>(static_cast<float>(value)));
  }
}

void MeshBuilder::add_face(std::span<const int> corners) {
  if (corners.size() > 3) {
    polygons_.push_back({std::ssize(triangles_) / 3, std::ssize(corners)});
  }
  for (std::size_t i = 2; i < corners.size(); ++i) {
    triangles_.insert(triangles_.end(), {corners[0], corners[i - 1], corners[i]});
  }
  ++faces_;
}

/// Replaces a polygon's fan by polygon_triangles().
void MeshBuilder::cut(const Polygon& polygon, SurfaceMesh& mesh) const {
  auto fan = mesh.triangles.middleCols(polygon.first, polygon.corners - 2);
  Eigen::VectorXi corners(polygon.corners);
  corners << fan(0, 0), fan(1, 0), fan.row(2).transpose();
  if (corners.minCoeff() < 0 || corners.maxCoeff() >= mesh.vertex_count()) return;
  const Eigen::Matrix3Xd places = mesh.vertices(Eigen::all, corners);
  if (!places.allFinite()) return;
  Eigen::Index column = 0;
  for (const Eigen::Vector3i& triangle : polygon_triangles(places)) {
    fan.col(column++) = corners(triangle);
  }
}

SurfaceMesh MeshBuilder::mesh() const {
  SurfaceMesh mesh;
  mesh.vertices = Eigen::Map<const Eigen::Matrix3Xd>(points_.data(), 3,
                                                     static_cast<Eigen::Index>(vertex_count()));
  mesh.triangles =
      Eigen::Map<const Eigen::Matrix3Xi>(triangles_.data(), 3, std::ssize(triangles_) / 3);
  for (const Polygon& polygon : polygons_) cut(polygon, mesh);
  return mesh;
}

}  // namespace lensforge
