// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
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

/// The cotangents of a triangle's angles, each for the opposite edge k (from corner k to k+1);
/// bounded for a triangle without area, zeros for one without sides.
Eigen::Vector3d cotangents(const Corners& corners);

/// Measures of a mesh's faces, a column each.
struct Faces {
  Eigen::Matrix3Xd normal;  ///< Unit; zero for a face without area.
  Eigen::Matrix3Xd centroid;
  Eigen::VectorXd area;

  [[nodiscard]] Eigen::Index count() const { return area.size(); }
  /// Shares of the whole area: a_k = A_k/ΣA.
  [[nodiscard]] Eigen::VectorXd area_share() const { return area / area.sum(); }
};

Faces measure_faces(const SurfaceMesh& mesh);

/// Signed volume between the mesh and the origin, a sixth of the sum of the corners' determinants.
/// For a closed mesh it is the volume inside, positive if its faces look outwards.
double signed_volume(const SurfaceMesh& mesh);

/// Length of the diagonal of the axis-aligned bounding box.
double bounding_diagonal(const SurfaceMesh& mesh);

/// Separates a mesh where it is no manifold: at an edge with more than two faces those stay
/// together that have the same material between them, by the directions in which they run along it;
/// one without a partner gets a boundary. Vertices where surfaces merely touch are doubled.
/// @pre no edge with more than two faces between two vertices where the surface is one: quartered()
///      gives every edge a vertex of its own.
SurfaceMesh separated(const SurfaceMesh& mesh);

/// Cuts every face in four at the middles of its edges: the same surface.
SurfaceMesh quartered(const SurfaceMesh& mesh);

/// Remeshes the surface into about `faces` even triangles by CGAL's isotropic remeshing (Botsch &
/// Kobbelt 2004). Creases of more than 50° that are longer than two edges, and boundaries, keep
/// their place. @return within 3 % of `faces` on every drawn shape at 300 to 10,000 faces, none of
/// them smaller than 0.7 % of their mean. @pre mesh of repair_mesh()
/// @throw InputError naming --faces if CGAL cannot take the mesh.
SurfaceMesh remeshed(const SurfaceMesh& mesh, int faces);

/// Share of the edges that is split (Tojo et al., 4.5).
inline constexpr double kSplitShare = 0.05;

/// Criterion of how much every edge hampers a clean crease (Tojo et al., 4.5): C = (E_k1 +
/// E_k2)·Σ_{four neighbouring edges} |e| arccos(n_1·n_2); 0 at the boundary. In the order of
/// make_edges().
Eigen::VectorXd split_criterion(const SurfaceMesh& mesh, const Eigen::VectorXd& energy_by_face);

/// Returns at most `count` edges with the largest positive criterion, no two with a common vertex.
/// @param partner  mirror image of every vertex: edges are then chosen in pairs; empty: none.
std::vector<int> chosen_edges(const SurfaceMesh& mesh, const Eigen::VectorXd& criterion, int count,
                              const std::vector<int>& partner);

/// Cuts edges at their middles. New vertices follow the old ones, in the edges' order, and so do
/// the second halves of faces. @pre no two edges share a vertex
struct SplitMesh {
  SurfaceMesh mesh;
  std::vector<int> parent;  ///< The face that each new face was cut from.
};
SplitMesh split_at_middles(const SurfaceMesh& mesh, const std::vector<int>& edges);

/// Returns the mirror image of every vertex about the middle of the bounding box, across an axis
/// (0: x).
/// @throw InputError naming --symmetry and a vertex without one: vertices must match within 1e-4 of
///        the box's diagonal.
std::vector<int> mirror_partners(const SurfaceMesh& mesh, int axis);

/// Distance from the surface at which rays begin, as a share of the mesh's diagonal: 30 times the
/// rounding of Embree's single precision.
inline constexpr double kRayOffset = 1e-5;

/// Hit of a ray.
struct RayHit {
  int face = -1;  ///< −1 if it met nothing.
  double distance = 0.0;

  [[nodiscard]] bool met() const { return face >= 0; }
};

/// Rays against a triangle mesh, by Embree. Thread-safe; the answers do not depend on the number of
/// threads.
class RayScene {
 public:
  /// As `reach`: however far away.
  static constexpr double kAnywhere = std::numeric_limits<double>::infinity();

  explicit RayScene(const SurfaceMesh& mesh);

  /// The first face hit by the ray from p along the unit vector w, from either side.
  [[nodiscard]] RayHit nearest(const Eigen::Vector3d& p, const Eigen::Vector3d& w) const;

  /// True if a face lies within the distance `reach` from p along w.
  [[nodiscard]] bool blocked(const Eigen::Vector3d& p, const Eigen::Vector3d& w,
                             double reach) const;

  /// Moves a point of the surface out along the normal so that its rays do not hit its own face.
  [[nodiscard]] Eigen::Vector3d lifted(const Eigen::Vector3d& p, const Eigen::Vector3d& n) const {
    return p + offset_ * n;
  }

 private:
  struct Handles;
  std::shared_ptr<const Handles> handles_;
  double offset_ = 0.0;
};

}  // namespace lensforge::reflect
