// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh_importer.h"

namespace lensforge {

using OpenMesh::FaceHandle;
using OpenMesh::Vec3d;
using OpenMesh::Vec3f;
using OpenMesh::VertexHandle;

std::string MeshImporter::problem() const {
  if (!first_problem_.empty()) return first_problem_;
  // OpenMesh's readers stop silently where a file ends early.
  if (n_vertices() < announced_vertices_ || n_faces() < announced_faces_) {
    return "announces " + std::to_string(announced_vertices_) + " vertices and " +
           std::to_string(announced_faces_) + " faces but holds " + std::to_string(n_vertices()) +
           " and " + std::to_string(n_faces()) + ": it is truncated or corrupt";
  }
  return {};
}

SurfaceMesh MeshImporter::mesh() const {
  SurfaceMesh mesh;
  mesh.vertices = Eigen::Map<const Eigen::Matrix3Xd>(points_.data(), 3,
                                                     static_cast<Eigen::Index>(n_vertices()));
  mesh.triangles =
      Eigen::Map<const Eigen::Matrix3Xi>(corners_.data(), 3, static_cast<Eigen::Index>(n_faces()));
  return mesh;
}

VertexHandle MeshImporter::add_vertex(const Vec3f& point) { return add_vertex(Vec3d(point)); }

VertexHandle MeshImporter::add_vertex(const Vec3d& point) {
  const VertexHandle vertex(static_cast<int>(n_vertices()));
  points_.insert(points_.end(), point.data(), point.data() + 3);
  return vertex;
}

VertexHandle MeshImporter::add_vertex() { return add_vertex(Vec3d(0.0)); }

FaceHandle MeshImporter::add_face(const VHandles& corners) {
  const FaceHandle face(static_cast<int>(n_faces()));
  if (corners.size() == 3) {
    for (const VertexHandle corner : corners) corners_.push_back(corner.idx());
  } else if (first_problem_.empty()) {
    first_problem_ = "face " + std::to_string(face.idx()) + " has " +
                     std::to_string(corners.size()) + " corners: only triangles can be read";
  }
  return face;
}

void MeshImporter::set_point(VertexHandle vertex, const Vec3f& point) {
  if (!vertex.is_valid() || static_cast<std::size_t>(vertex.idx()) >= n_vertices()) return;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    points_[3 * static_cast<std::size_t>(vertex.idx()) + axis] = static_cast<double>(point[axis]);
  }
}

void MeshImporter::reserve(unsigned int vertices, unsigned int /*edges*/, unsigned int faces) {
  // Only remembered: a corrupt header may ask for more memory than there is.
  announced_vertices_ = vertices;
  announced_faces_ = faces;
}

}  // namespace lensforge
