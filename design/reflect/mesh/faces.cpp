// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/mesh/faces.h"

#include <Eigen/Geometry>

#include "design/reflect/mesh/edges.h"

namespace lensforge::reflect {

Faces measure_faces(const SurfaceMesh& mesh) {
  const Eigen::Index count = mesh.triangle_count();
  Faces faces{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd(3, count), Eigen::VectorXd(count)};
  for (Eigen::Index k = 0; k < count; ++k) {
    const Corners c = mesh.corners(k);
    const Eigen::Vector3d twice = area_normal(c);
    faces.area[k] = 0.5 * twice.norm();
    faces.normal.col(k) = twice.stableNormalized();
    faces.centroid.col(k) = (c.v0 + c.v1 + c.v2) / 3.0;
  }
  return faces;
}

double signed_volume(const SurfaceMesh& mesh) {
  double six_volumes = 0.0;
  for (std::int64_t k = 0; k < mesh.triangle_count(); ++k) {
    const Corners c = mesh.corners(k);
    six_volumes += c.v0.dot(c.v1.cross(c.v2));
  }
  return six_volumes / 6.0;
}

double bounding_diagonal(const SurfaceMesh& mesh) {
  return (mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff()).norm();
}

SurfaceMesh quartered(const SurfaceMesh& mesh) {
  const EdgeTable table = make_edges(mesh);
  const auto old = static_cast<int>(mesh.vertex_count());
  SurfaceMesh fine;
  fine.vertices.resize(3, mesh.vertex_count() + table.count());
  fine.vertices.leftCols(old) = mesh.vertices;
  for (int e = 0; e < table.count(); ++e) {
    const Edge& edge = table.edges[static_cast<std::size_t>(e)];
    fine.vertices.col(old + e) = 0.5 * (mesh.vertices.col(edge.from) + mesh.vertices.col(edge.to));
  }
  fine.triangles.resize(3, 4 * mesh.triangle_count());
  for (Eigen::Index k = 0; k < mesh.triangle_count(); ++k) {
    const Eigen::Vector3i v = mesh.triangles.col(k);
    const Eigen::Vector3i m = table.of_face.col(k).array() + old;
    fine.triangles.col(4 * k) << v[0], m[0], m[2];
    fine.triangles.col(4 * k + 1) << v[1], m[1], m[0];
    fine.triangles.col(4 * k + 2) << v[2], m[2], m[1];
    fine.triangles.col(4 * k + 3) << m[0], m[1], m[2];
  }
  return fine;
}

}  // namespace lensforge::reflect
