// SPDX-License-Identifier: GPL-3.0-or-later
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/Euler_operations.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
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
/// Maximum number of runs; each corrects the length of edges by the last number of faces.
constexpr int kRuns = 10;
/// The runs end at a number of faces within this share of the one asked for.
constexpr double kTolerance = 0.03;
/// Even meshes have edges of few lengths, so that all of them split or collapse at once and no
/// length gives some numbers of faces. The second half of the runs begins with a mesh whose edges
/// have this share of the wanted length.
constexpr double kFiner = 0.6;
/// Minimum length of a crease that is kept, in lengths of an edge.
constexpr double kShortestCrease = 2.0;

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

SurfaceMesh from_cgal(const CgalMesh& mesh) {
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

using Vertex = CgalMesh::Vertex_index;
using Face = CgalMesh::Face_index;
using Half = CgalMesh::Halfedge_index;
using Creases = CgalMesh::Property_map<CgalMesh::Edge_index, bool>;

Eigen::Vector3d place(const CgalMesh& mesh, Vertex v) {
  const Kernel::Point_3& p = mesh.point(v);
  return {p.x(), p.y(), p.z()};
}

double squared_length(const CgalMesh& mesh, Half h) {
  return (place(mesh, mesh.target(h)) - place(mesh, mesh.source(h))).squaredNorm();
}

/// Marks edges between faces that turn by more than kCreaseDegrees, where such edges hang together
/// for at least `shortest`: a shorter crease is noise or lost between faces of that size.
Creases marked_creases(CgalMesh& mesh, double shortest) {
  auto crease = mesh.add_property_map<CgalMesh::Edge_index, bool>("e:crease", false).first;
  pmp::detect_sharp_edges(mesh, kCreaseDegrees, crease);
  std::vector<bool> reached(mesh.num_edges(), false);
  for (const auto first : mesh.edges()) {
    if (!crease[first] || reached[first.idx()]) continue;
    std::vector<CgalMesh::Edge_index> chain{first};
    reached[first.idx()] = true;
    double length = 0.0;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      length += std::sqrt(squared_length(mesh, mesh.halfedge(chain[i])));
      for (const unsigned end : {0U, 1U}) {
        for (const Half h : CGAL::halfedges_around_target(mesh.halfedge(chain[i], end), mesh)) {
          const auto next = mesh.edge(h);
          if (!crease[next] || reached[next.idx()]) continue;
          reached[next.idx()] = true;
          chain.push_back(next);
        }
      }
    }
    if (length >= shortest) continue;
    for (const auto e : chain) crease[e] = false;
  }
  return crease;
}

Eigen::Vector3d doubled_area(const CgalMesh& mesh, Face f) {
  const Half h = mesh.halfedge(f);
  const Eigen::Vector3d a = place(mesh, mesh.source(h));
  return (place(mesh, mesh.target(h)) - a).cross(place(mesh, mesh.target(mesh.next(h))) - a);
}

/// Removes thin faces of a mesh, one after the other: the shortest side of a needle collapses, the
/// longest side of a face whose corners are nearly collinear is flipped.
class ThinFaces {
 public:
  explicit ThinFaces(CgalMesh& mesh) : mesh_(mesh) {}

  void remove() {
    bool any = true;
    for (int pass = 0; pass < kPasses && any; ++pass) {
      any = false;
      const std::vector<Face> faces(mesh_.faces().begin(), mesh_.faces().end());
      for (const Face f : faces) any = (!mesh_.is_removed(f) && is_thin(f) && mend(f)) || any;
    }
  }

 private:
  /// Height over the longest side, below which a face is thin. Even remeshed faces have 0.87.
  static constexpr double kThinnest = 0.1;
  /// A thin face's shortest side is below this share of its longest in a needle.
  static constexpr double kNeedle = 0.25;
  static constexpr int kPasses = 10;
  /// Cosine of the largest angle by which a mend may turn a face that is not thin.
  static constexpr double kMaxTurn = 0.5;

  struct Sides {
    Half shortest;
    Half longest;
  };
  [[nodiscard]] Sides sides(Face f) const {
    const Half h = mesh_.halfedge(f);
    const std::array<Half, 3> all{h, mesh_.next(h), mesh_.prev(h)};
    const auto shorter = [&](Half a, Half b) {
      return squared_length(mesh_, a) < squared_length(mesh_, b);
    };
    return {*std::min_element(all.begin(), all.end(), shorter),
            *std::max_element(all.begin(), all.end(), shorter)};
  }

  [[nodiscard]] bool is_thin(Face f) const {
    return doubled_area(mesh_, f).norm() < kThinnest * squared_length(mesh_, sides(f).longest);
  }

  bool mend(Face f) {
    const Sides side = sides(f);
    const double ratio = squared_length(mesh_, side.shortest) / squared_length(mesh_, side.longest);
    if (ratio < kNeedle * kNeedle) return collapse(side.shortest) || flip(side.longest);
    return flip(side.longest) || collapse(side.shortest);
  }

  bool flip(Half h) {
    if (mesh_.is_border(mesh_.edge(h))) return false;
    const Vertex a = mesh_.target(mesh_.next(h));
    const Vertex b = mesh_.target(mesh_.next(mesh_.opposite(h)));
    if (mesh_.halfedge(a, b).is_valid()) return false;
    const Eigen::Vector3d p = place(mesh_, a);
    const Eigen::Vector3d q = place(mesh_, b);
    const Eigen::Vector3d from = place(mesh_, mesh_.source(h));
    const Eigen::Vector3d to = place(mesh_, mesh_.target(h));
    const Eigen::Vector3d old = doubled_area(mesh_, mesh_.face(mesh_.opposite(h))).normalized();
    const Eigen::Vector3d one = (from - p).cross(q - p);
    const Eigen::Vector3d other = (q - p).cross(to - p);
    if (one.dot(old) < kMaxTurn * one.norm() || other.dot(old) < kMaxTurn * other.norm()) {
      return false;
    }
    if (!(std::min(one.norm(), other.norm()) > doubled_area(mesh_, mesh_.face(h)).norm())) {
      return false;
    }
    CGAL::Euler::flip_edge(h, mesh_);
    return true;
  }

  bool collapse(Half h) {
    const auto edge = mesh_.edge(h);
    if (!CGAL::Euler::does_satisfy_link_condition(edge, mesh_)) return false;
    const Eigen::Vector3d middle =
        0.5 * (place(mesh_, mesh_.source(h)) + place(mesh_, mesh_.target(h)));
    if (turns(h, middle) || turns(mesh_.opposite(h), middle)) return false;
    const Vertex kept = CGAL::Euler::collapse_edge(edge, mesh_);
    mesh_.point(kept) = Kernel::Point_3(middle.x(), middle.y(), middle.z());
    return true;
  }

  /// True if moving the target of h to `to` turns a face around it too far.
  [[nodiscard]] bool turns(Half h, const Eigen::Vector3d& to) const {
    for (const Half around : CGAL::halfedges_around_target(h, mesh_)) {
      const Face f = mesh_.face(around);
      if (!f.is_valid() || f == mesh_.face(h) || f == mesh_.face(mesh_.opposite(h)) || is_thin(f)) {
        continue;
      }
      const Eigen::Vector3d a = place(mesh_, mesh_.target(mesh_.next(around)));
      const Eigen::Vector3d now = (a - to).cross(place(mesh_, mesh_.source(around)) - to);
      const Eigen::Vector3d old = doubled_area(mesh_, f);
      if (now.dot(old) < kMaxTurn * now.norm() * old.norm()) return true;
    }
    return false;
  }

  CgalMesh& mesh_;
};

/// Even triangles whose edges have about this length. Creases keep their place, but are divided
/// anew: edges of the mesh as it came may be far shorter.
CgalMesh with_edges_of(CgalMesh mesh, double length) {
  Creases crease = marked_creases(mesh, kShortestCrease * length);
  pmp::isotropic_remeshing(mesh.faces(), length, mesh,
                           pmp::parameters::number_of_iterations(kSmoothings)
                               .edge_is_constrained_map(crease)
                               .relax_constraints(true));
  pmp::remove_degenerate_faces(mesh);
  ThinFaces(mesh).remove();
  mesh.remove_property_map(crease);
  mesh.collect_garbage();
  return mesh;
}

/// Looks for the length of edges that gives the wanted number of faces.
class LengthSearch {
 public:
  explicit LengthSearch(double length) : length_(length) {}

  [[nodiscard]] double length() const { return length_; }

  /// @param ratio  of the faces at this length to the wanted ones.
  void record(double ratio) {
    (ratio > 1.0 ? short_ : long_) = length_;
    length_ = short_ > 0.0 && long_ > 0.0 ? std::sqrt(short_ * long_) : length_ * std::sqrt(ratio);
  }

 private:
  double length_;
  double short_ = 0.0;  ///< The last length with too many faces; 0: none yet.
  double long_ = 0.0;   ///< The last length with too few.
};

/// Splits the longest edges until the mesh has this number of faces.
SurfaceMesh filled_up(const SurfaceMesh& mesh, int faces) {
  const EdgeTable table = make_edges(mesh);
  Eigen::VectorXd length(table.count());
  for (int e = 0; e < table.count(); ++e) {
    const Edge& edge = table.edges[static_cast<std::size_t>(e)];
    length[e] = (mesh.vertices.col(edge.to) - mesh.vertices.col(edge.from)).norm();
  }
  const int missing = (faces - static_cast<int>(mesh.triangle_count())) / 2;
  return split_at_middles(mesh, chosen_edges(mesh, length, missing, {})).mesh;
}

}  // namespace

SurfaceMesh remeshed(const SurfaceMesh& mesh, int faces) {
  CgalMesh start = to_cgal(mesh);
  LengthSearch search(std::sqrt(4.0 * measure_faces(mesh).area.sum() / (std::sqrt(3.0) * faces)));
  SurfaceMesh nearest;
  SurfaceMesh fewer;  // With the most faces of those that have too few.
  double least = std::numeric_limits<double>::infinity();
  for (int run = 0; run < kRuns && least > kTolerance; ++run) {
    if (run == kRuns / 2) {
      start = with_edges_of(start, kFiner * search.length());
      search = LengthSearch(search.length());
    }
    const SurfaceMesh result = from_cgal(with_edges_of(start, search.length()));
    const double ratio = static_cast<double>(result.triangle_count()) / faces;
    if (ratio < 1.0 && result.triangle_count() > fewer.triangle_count()) fewer = result;
    if (std::abs(ratio - 1.0) < least) nearest = result;
    least = std::min(least, std::abs(ratio - 1.0));
    search.record(ratio);
  }
  const bool fill = least > kTolerance && fewer.triangle_count() > 0;
  return fill ? filled_up(fewer, faces) : nearest;
}

}  // namespace lensforge::reflect
