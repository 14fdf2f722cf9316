// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "cam/contact/ball_cutter.h"
#include "cam/contact/drop_cutter.h"
#include "cam/workshop/tool.h"
#include "cam/workshop/workshop.h"
#include "core/mesh/surface_mesh.h"

/// A vertical cutter of any profile against points, edges and facets.
///
/// Notation: g(d) height of the profile above the tip at distance d from the axis, p = (x, y)
/// position of the axis. A point q holds the tool up at f(q) = q.z − g(|q.xy − p|); the answer for
/// a set of points is the largest f over it. g is convex and nowhere falling, so f is concave on a
/// triangle: its maximum is the tangent contact inside the facet, or it lies on an edge.
namespace lensforge {

/// Height of the tip of the tool that rests on point q, mm; kNoContact if q is not under it.
double profile_vertex_tip(const CutterProfile& profile, const Eigen::Vector2d& p,
                          const Eigen::Vector3d& q);

/// Height of the tip of the tool that rests on the segment ab, its ends included, mm; kNoContact if
/// no part of it is under the tool.
double profile_edge_tip(const CutterProfile& profile, const Eigen::Vector2d& p,
                        const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// Height of the tip of the tool that rests on a whole triangle (columns: its corners), mm;
/// kNoContact if no part of it is under the tool. Error against the exact maximum of f: 1e-12 mm
/// for triangles of a few millimetres (ProfileContact.AgreesWithTheBall); on steeper ones than
/// 1 : 1000 the height is exact for a p within 1e-13 mm.
/// @param enough  if the maximum is lower than this, mm, any height below it may be returned
///                (faster).
double profile_triangle_tip(const CutterProfile& profile, const Eigen::Vector2d& p,
                            const Eigen::Matrix3d& corners, double enough = kNoContact);

/// Height of the tip of the tool that rests on a level rectangle `low` … `high` (seen from above)
/// at height z, mm; kNoContact if no part of it is under the tool.
double profile_box_tip(const CutterProfile& profile, const Eigen::Vector2d& p,
                       const Eigen::AlignedBox3d& box);

/// Lets tools of any profile down on a mesh: for any (x, y) the lowest height of the tip at which
/// the profile cuts into no triangle; exact, over facets, edges and vertices. One index serves
/// every profile. DropCutter is faster for the finishing ball, which needs millions of points a
/// second.
///
/// Triangles are stored in the cells of a grid by their boxes' centres. Above it is a pyramid: each
/// node has the box of the four below it and its highest point. A search descends into the node
/// that could lift the tool most, and skips those that could not lift it above what it rests on
/// already.
class ProfileCutter {
 public:
  /// @pre all coordinates are finite and all vertex numbers in range.
  explicit ProfileCutter(const SurfaceMesh& mesh);

  /// The location of the tip over p (mm). Equal to the largest profile_triangle_tip() over all
  /// triangles to 1e-12 mm (ProfileCutter.EqualsBruteForce…). `near`, a close location, makes it
  /// faster and changes the height by no more than rounding. A profile of radius 0 returns the
  /// surface's own height.
  [[nodiscard]] CutterLocation drop(const CutterProfile& profile, const Eigen::Vector2d& p,
                                    const CutterLocation& near = {}) const;

  /// Height of the tip over p on the triangle alone that holds it up at a close location, mm: at
  /// most that of drop(); kNoContact if it is not under the tool.
  [[nodiscard]] double rest_on(const CutterProfile& profile, const Eigen::Vector2d& p,
                               const CutterLocation& near) const;

  /// Box of the mesh's vertices that belong to triangles; empty without triangles.
  [[nodiscard]] const Eigen::AlignedBox3d& bounds() const { return bounds_; }

 private:
  /// Box seen from above, relative to the grid's origin, rounded outwards; highest corner, exact.
  struct Node {
    float x_min, x_max, y_min, y_max;
    std::int32_t top;  ///< The item with the highest corner.
    double z_max;
  };
  struct Level {
    int columns = 0;
    int rows = 0;
    std::vector<Node> nodes;
  };
  struct Search;

  void sort_into_cells(const SurfaceMesh& mesh, double cell);
  void build_pyramid();
  void search_node(std::size_t level, int column, int row, Search& search) const;
  void search_cell(std::size_t cell, Search& search) const;
  void try_item(std::int64_t item, Search& search) const;

  Eigen::AlignedBox3d bounds_;
  std::vector<Level> levels_;        ///< From the cells to a single node.
  std::vector<std::int64_t> begin_;  ///< First item of each cell, row by row, and the end.
  // Items are triangles in the order of cells; all of the same length.
  std::vector<Node> boxes_;
  std::vector<Eigen::Matrix3d> corners_;
  std::vector<std::int32_t> triangle_of_;
  std::vector<std::int32_t> item_of_;  ///< Inverse of triangle_of_.
};

/// Minimum height of a tool's tip: on the surface plus an allowance, with shank and holder clear of
/// it as well, and the whole tool clear of the clamps.
///
/// Beyond hold() outside the surface's rim the tip keeps the height that it has there, where its
/// rounded edge has dropped by 0.3 of the edge's radius: enough to clear the rim of surfaces that
/// fall towards it without cutting more beside the part.
class TipFloor {
 public:
  /// Contacts that hold the tip up near a place, to start the next search from: one per part of the
  /// tool.
  using Trace = std::vector<CutterLocation>;

  /// @param surface  must outlive this. @param keep_outs  must outlive this.
  TipFloor(const ProfileCutter& surface, const Tool& tool, double allowance,
           std::span<const KeepOut> keep_outs, double clearance);
  /// Without clamps. @param rim  of this part, where the surface holds several.
  TipFloor(const ProfileCutter& surface, const Tool& tool, double allowance,
           const Eigen::AlignedBox2d& rim);

  /// Maximum of the tip's minimum height over all places within `reach` of p, mm: a move of length
  /// 2·reach around p that stays above it cuts into nothing.
  [[nodiscard]] double over(const Eigen::Vector2d& p, double reach, Trace& trace) const;
  /// The same without the clamps, and with nothing but the clamps.
  [[nodiscard]] double over_surface(const Eigen::Vector2d& p, double reach, Trace& trace) const;
  [[nodiscard]] double over_clamps(const Eigen::Vector2d& p, double reach) const;
  [[nodiscard]] bool has_clamps() const { return !keep_outs_.empty(); }

  /// A lower bound of over(p, 0, …), found faster: from the contacts near p.
  [[nodiscard]] double at_least(const Eigen::Vector2d& p, const Trace& trace) const;

  /// Distance beyond the rim at which the tip starts to keep its height, mm.
  [[nodiscard]] double hold() const { return hold_; }
  static double hold_of(const Tool& tool, double allowance);

 private:
  [[nodiscard]] Eigen::Vector2d held(const Eigen::Vector2d& p) const;

  const ProfileCutter& surface_;
  Eigen::AlignedBox2d rim_;
  std::span<const KeepOut> keep_outs_;
  double clearance_;
  std::vector<CutterProfile> parts_;  ///< Of the tool with its allowance.
  std::vector<CutterProfile> whole_;  ///< Of the tool with its clearance from clamps.
  double hold_;
};

}  // namespace lensforge
