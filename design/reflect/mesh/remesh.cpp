// SPDX-License-Identifier: GPL-3.0-or-later
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Surface_mesh.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "core/error.h"
#include "design/reflect/mesh/faces.h"

namespace lensforge::reflect {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using CgalMesh = CGAL::Surface_mesh<Kernel::Point_3>;

constexpr double kCreaseDegrees = 50.0;
constexpr int kSmoothings = 3;
/// Number of runs; each corrects the length of edges by the last number of faces.
constexpr int kRuns = 4;
constexpr double kTolerance = 0.05;

CgalMesh to_cgal(const SurfaceMesh& mesh) {
  std::vector<Kernel::Point_3> points;
  std::vector<std::array<std::size_t, 3>> polygons;
  for (Eigen::Index v = 0; v < mesh.vertex_count(); ++v) {
    const Eigen::Vector3d p = mesh.vertices.col(v);
    points.emplace_back(p.x(), p.y(), p.z());
  }
  for (Eigen::Index k = 0; k < mesh.triangle_count(); ++k) {
    const Eigen::Matrix<std::size_t, 3, 1> t = mesh.triangles.col(k).cast<std::size_t>();
    polygons.push_back({t[0], t[1], t[2]});
  }
  pmp::orient_polygon_soup(points, polygons);  // Splits vertices where pieces touch in one.
  if (!pmp::is_polygon_soup_a_polygon_mesh(polygons)) {
    throw InputError("--faces: the mesh cannot be remeshed; --faces 0 takes it as it is");
  }
  CgalMesh result;
  pmp::polygon_soup_to_polygon_mesh(points, polygons, result);
  return result;
}

SurfaceMesh from_cgal(CgalMesh mesh) {
  mesh.collect_garbage();
  SurfaceMesh result;
  result.vertices.resize(3, static_cast<Eigen::Index>(mesh.number_of_vertices()));
  result.triangles.resize(3, static_cast<Eigen::Index>(mesh.number_of_faces()));
  for (const auto v : mesh.vertices()) {
    const Kernel::Point_3& p = mesh.point(v);
    result.vertices.col(static_cast<Eigen::Index>(v.idx())) << p.x(), p.y(), p.z();
  }
  for (const auto f : mesh.faces()) {
    Eigen::Index k = 0;
    for (const auto v : CGAL::vertices_around_face(mesh.halfedge(f), mesh)) {
      result.triangles(k++, static_cast<Eigen::Index>(f.idx())) = static_cast<int>(v.idx());
    }
  }
  return result;
}

CgalMesh with_edges_of(CgalMesh mesh, double length) {
  auto crease = mesh.add_property_map<CgalMesh::Edge_index, bool>("e:crease", false).first;
  pmp::detect_sharp_edges(mesh, kCreaseDegrees, crease);
  std::vector<CgalMesh::Edge_index> creases;
  for (const auto e : mesh.edges()) {
    if (crease[e] || mesh.is_border(e)) creases.push_back(e);
  }
  pmp::split_long_edges(creases, length, mesh, pmp::parameters::edge_is_constrained_map(crease));
  pmp::isotropic_remeshing(mesh.faces(), length, mesh,
                           pmp::parameters::number_of_iterations(kSmoothings)
                               .protect_constraints(true)
                               .edge_is_constrained_map(crease));
  // Faces without area may be left between protected creases.
  pmp::remove_degenerate_faces(mesh);
  return mesh;
}

}  // namespace

SurfaceMesh remeshed(const SurfaceMesh& mesh, int faces) {
  const CgalMesh start = to_cgal(mesh);
  const double area = measure_faces(mesh).area.sum();
  double length = std::sqrt(4.0 * area / (std::sqrt(3.0) * faces));
  SurfaceMesh result;
  for (int run = 0; run < kRuns; ++run) {
    result = from_cgal(with_edges_of(start, length));
    const double ratio = static_cast<double>(result.triangle_count()) / faces;
    if (std::abs(ratio - 1.0) < kTolerance) break;
    length *= std::sqrt(ratio);
  }
  return result;
}

}  // namespace lensforge::reflect
