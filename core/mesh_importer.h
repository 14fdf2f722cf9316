// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <string>
#include <vector>

#include "core/surface_mesh.h"

namespace lensforge {

/// Takes what OpenMesh's readers find straight into flat arrays. OpenMesh's own importer goes
/// through half-edges, which drops or doubles what is no manifold and cuts polygons up unasked.
class MeshImporter final : public OpenMesh::IO::BaseImporter {
 public:
  /// Why the file's content is no mesh of triangles; empty if it is.
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] SurfaceMesh mesh() const;

  OpenMesh::VertexHandle add_vertex(const OpenMesh::Vec3f& point) override;
  OpenMesh::VertexHandle add_vertex(const OpenMesh::Vec3d& point) override;
  OpenMesh::VertexHandle add_vertex() override;
  OpenMesh::FaceHandle add_face(const VHandles& corners) override;
  void set_point(OpenMesh::VertexHandle vertex, const OpenMesh::Vec3f& point) override;
  void reserve(unsigned int vertices, unsigned int edges, unsigned int faces) override;
  [[nodiscard]] bool is_triangle_mesh() const override { return true; }
  [[nodiscard]] std::size_t n_vertices() const override { return points_.size() / 3; }
  [[nodiscard]] std::size_t n_faces() const override { return corners_.size() / 3; }
  [[nodiscard]] std::size_t n_edges() const override { return 0; }

  // Everything else that a file may hold is of no use to a lens.
  // clang-format off
  OpenMesh::HalfedgeHandle add_edge(OpenMesh::VertexHandle, OpenMesh::VertexHandle) override { return OpenMesh::HalfedgeHandle(); }
  OpenMesh::FaceHandle add_face(OpenMesh::HalfedgeHandle) override { return OpenMesh::FaceHandle(); }
  void add_face_texcoords(OpenMesh::FaceHandle, OpenMesh::VertexHandle, const std::vector<OpenMesh::Vec2f>&) override {}
  void add_face_texcoords(OpenMesh::FaceHandle, OpenMesh::VertexHandle, const std::vector<OpenMesh::Vec3f>&) override {}
  void set_face_texindex(OpenMesh::FaceHandle, int) override {}
  void set_halfedge(OpenMesh::VertexHandle, OpenMesh::HalfedgeHandle) override {}
  void set_normal(OpenMesh::VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_normal(OpenMesh::VertexHandle, const OpenMesh::Vec3d&) override {}
  void set_color(OpenMesh::VertexHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(OpenMesh::VertexHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(OpenMesh::VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_color(OpenMesh::VertexHandle, const OpenMesh::Vec4f&) override {}
  void set_texcoord(OpenMesh::VertexHandle, const OpenMesh::Vec2f&) override {}
  void set_status(OpenMesh::VertexHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_next(OpenMesh::HalfedgeHandle, OpenMesh::HalfedgeHandle) override {}
  void set_face(OpenMesh::HalfedgeHandle, OpenMesh::FaceHandle) override {}
  void request_face_texcoords2D() override {}
  void set_texcoord(OpenMesh::HalfedgeHandle, const OpenMesh::Vec2f&) override {}
  void set_texcoord(OpenMesh::VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_texcoord(OpenMesh::HalfedgeHandle, const OpenMesh::Vec3f&) override {}
  void set_status(OpenMesh::HalfedgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec3f&) override {}
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec4f&) override {}
  void set_status(OpenMesh::EdgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_normal(OpenMesh::FaceHandle, const OpenMesh::Vec3f&) override {}
  void set_normal(OpenMesh::FaceHandle, const OpenMesh::Vec3d&) override {}
  void set_color(OpenMesh::FaceHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(OpenMesh::FaceHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(OpenMesh::FaceHandle, const OpenMesh::Vec3f&) override {}
  void set_color(OpenMesh::FaceHandle, const OpenMesh::Vec4f&) override {}
  void set_status(OpenMesh::FaceHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void add_texture_information(int, std::string) override {}
  // clang-format on

 private:
  std::vector<double> points_;
  std::vector<int> corners_;
  unsigned int announced_vertices_ = 0;
  unsigned int announced_faces_ = 0;
  std::string first_problem_;
};

}  // namespace lensforge
