// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// An edge between two vertices and the faces beside it.
struct Edge {
  int from = 0;  ///< The smaller vertex number.
  int to = 0;
  int left = -1;   ///< A face that uses the edge.
  int right = -1;  ///< The other one; −1 at the boundary.
};

/// All edges of a mesh.
struct EdgeTable {
  std::vector<Edge> edges;   ///< By their vertices, ascending.
  Eigen::Matrix3Xi of_face;  ///< 3 × F: edge k runs from corner k to corner k+1 mod 3.
  int crowded = -1;          ///< An edge with more than two faces; −1 if there is none.

  [[nodiscard]] int count() const { return static_cast<int>(edges.size()); }
  [[nodiscard]] bool is_closed() const;
  /// The face across edge k of a face; −1 at the boundary.
  [[nodiscard]] int across(Eigen::Index face, int k) const;
};

EdgeTable make_edges(const SurfaceMesh& mesh);

/// The cotangents of a triangle's angles, that of edge k (from corner k to k+1) opposite to it; a
/// triangle without area has zeros.
Eigen::Vector3d cotangents(const Corners& corners);

/// Measures of a mesh's faces, a column each.
struct Faces {
  Eigen::Matrix3Xd normal;  ///< Unit; zero for a face without area.
  Eigen::Matrix3Xd centroid;
  Eigen::VectorXd area;

  [[nodiscard]] Eigen::Index count() const { return area.size(); }
  /// Of the whole area: a_k = A_k/ΣA.
  [[nodiscard]] Eigen::VectorXd area_share() const { return area / area.sum(); }
};

Faces measure_faces(const SurfaceMesh& mesh);

/// Six times the signed volume between the mesh and the origin is the sum of the corners'
/// determinants; of a closed mesh this is the volume inside, positive if its faces look outwards.
double signed_volume(const SurfaceMesh& mesh);

/// Length of the diagonal of the axis-aligned bounding box.
double bounding_diagonal(const SurfaceMesh& mesh);

/// Every face cut in four at the middles of its edges: the same surface.
SurfaceMesh quartered(const SurfaceMesh& mesh);

/// A mesh of about `faces` even triangles over the same surface, by CGAL's isotropic remeshing
/// (Botsch & Kobbelt 2004). Creases of more than 50° and boundaries stay where they are.
/// @return within 10 % of `faces` on smooth shapes; creases take whole edges. @pre as repair_mesh()
/// returns it
/// @throw InputError naming --faces if CGAL cannot take the mesh.
SurfaceMesh remeshed(const SurfaceMesh& mesh, int faces);

/// Share of the edges that is split (Tojo et al., 4.5).
inline constexpr double kSplitShare = 0.05;

/// How much every edge stands in the way of a clean crease (Tojo et al., 4.5):
/// C = (E_k1 + E_k2)·Σ_{four neighbouring edges} |e| arccos(n_1·n_2); 0 at the boundary. In the
/// order of make_edges().
Eigen::VectorXd split_criterion(const SurfaceMesh& mesh, const Eigen::VectorXd& energy_by_face);

/// The edges with the largest criterion, at most `count`, no two with a vertex in common, none with
/// a criterion of 0. @param partner  mirror image of every vertex, so that edges are chosen in
/// pairs; empty: none.
std::vector<int> chosen_edges(const SurfaceMesh& mesh, const Eigen::VectorXd& criterion, int count,
                              const std::vector<int>& partner);

/// The mesh with these edges cut at their middles; the new vertices stand behind the old ones, in
/// the edges' order, and so do the second halves of faces. @pre no two edges share a vertex
struct SplitMesh {
  SurfaceMesh mesh;
  std::vector<int> parent;  ///< The face that each new face was cut from, from the first one on.
};
SplitMesh split_at_middles(const SurfaceMesh& mesh, const std::vector<int>& edges);

/// The mirror image of every vertex at the middle of the bounding box across an axis (0: x).
/// @throw InputError naming --symmetry and a vertex without one: vertices must match within 1e-4 of
///        the box's diagonal.
std::vector<int> mirror_partners(const SurfaceMesh& mesh, int axis);

/// How far from the surface rays begin, as a share of the mesh's diagonal: 30 times the rounding of
/// the single precision that Embree works in.
inline constexpr double kRayOffset = 1e-5;

/// Where a ray met the mesh.
struct RayHit {
  int face = -1;  ///< −1 if it met nothing.
  double distance = 0.0;

  [[nodiscard]] bool met() const { return face >= 0; }
};

/// Rays against a triangle mesh, by Embree. Safe to ask from several threads; the answers do not
/// depend on their number.
class RayScene {
 public:
  explicit RayScene(const SurfaceMesh& mesh);

  /// The first face that the ray from p along the unit vector w meets, from either side.
  [[nodiscard]] RayHit nearest(const Eigen::Vector3d& p, const Eigen::Vector3d& w) const;

  /// Whether a face stands between p and the distance `reach` (infinite: anywhere) along w.
  [[nodiscard]] bool blocked(const Eigen::Vector3d& p, const Eigen::Vector3d& w,
                             double reach) const;

  /// A point on the surface, moved out along the normal so that rays do not meet its own face.
  [[nodiscard]] Eigen::Vector3d lifted(const Eigen::Vector3d& p, const Eigen::Vector3d& n) const {
    return p + offset_ * n;
  }

 private:
  struct Handles;
  std::shared_ptr<const Handles> handles_;
  double offset_ = 0.0;
};

}  // namespace lensforge::reflect
