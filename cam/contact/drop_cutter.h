// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "cam/contact/ball_cutter.h"
#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// Edges and corners of a triangle to be tried against a ball, as bits: edge k (from corner k to
/// corner k+1 mod 3) is bit k, corner k is bit 3 + k.
using ContactFeatures = std::uint8_t;

inline constexpr ContactFeatures edge_bit(int k) { return static_cast<ContactFeatures>(1 << k); }
inline constexpr ContactFeatures corner_bit(int k) {
  return static_cast<ContactFeatures>(1 << (3 + k));
}

/// Assigns every edge and vertex of a mesh to the first of its triangles, so that a search over
/// triangles tries it once. Valleys and flat seams are assigned to none: a ball that touches them
/// touches a facet beside them at the same height. Edges of one triangle, of three or more, and of
/// triangles too thin or steep to judge are kept.
/// @return one set of bits per triangle.
/// @pre vertex numbers are in range.
std::vector<ContactFeatures> contact_features(const SurfaceMesh& mesh, const Executor& executor);

/// Resting position of a ball let down on a mesh.
struct CutterLocation {
  double tip = kNoContact;     ///< Height of the tip, mm; kNoContact if nothing is under the ball.
  std::int32_t triangle = -1;  ///< A triangle that holds the ball up; −1 if none does.

  [[nodiscard]] bool rests() const { return triangle >= 0; }
};

/// A triangle that may hold the ball up; the pointers live as long as the drop-cutter.
struct Contender {
  std::int32_t triangle = -1;
  ContactFeatures features = 0;              ///< Edges and corners assigned to it.
  const FacetContact* facet = nullptr;       ///< From `corners`.
  const Eigen::Matrix3d* corners = nullptr;  ///< Columns a, b, c; bc is the longest side.
};

/// Lets a ball-end mill down on a mesh: for any (x, y) the lowest height of the tip at which the
/// ball touches the mesh and cuts into none of it; exact, over facets, edges and vertices.
///
/// The mesh need not be a height field or a manifold; triangles may be vertical, upside down, thin,
/// without area, or doubled. Each triangle is stored in one cell of a grid over x and y; its size
/// chooses among grids of doubling cell size. A cell or triangle is skipped if even its highest
/// point at the nearest distance could not lift the ball further.
class DropCutter {
 public:
  /// @param radius  of the ball, mm, > 0.
  /// @pre all coordinates are finite and all vertex numbers in range.
  DropCutter(const SurfaceMesh& mesh, double radius, const Executor& executor);

  /// The location of the tip over p (mm). Equal to the largest triangle_tip() over all triangles to
  /// 1e-12 mm (DropCutter.EqualsBruteForce…). `near`, a close location, makes it faster; the result
  /// has the same bits.
  [[nodiscard]] CutterLocation drop(const Eigen::Vector2d& p,
                                    const CutterLocation& near = {}) const;

  /// drop() for many points; the same bits for any number of threads. @pre sizes are equal.
  void drop(std::span<const Eigen::Vector2d> points, std::span<CutterLocation> locations,
            const Executor& executor) const;

  /// Finds every triangle that holds the ball up somewhere between `from` and `to` (mm), in order
  /// of number, and possibly others. Short stretches have few. Replaces the contents of
  /// `contenders`.
  /// @param at_from  drop(from). @return drop(to), for the next stretch.
  CutterLocation find_contenders(const Eigen::Vector2d& from, const CutterLocation& at_from,
                                 const Eigen::Vector2d& to,
                                 std::vector<Contender>& contenders) const;

  [[nodiscard]] double radius() const { return radius_; }
  /// Corners of a triangle of the mesh, in some order, as columns.
  [[nodiscard]] const Eigen::Matrix3d& corners(std::int32_t triangle) const {
    return corners_[static_cast<std::size_t>(item_of_[static_cast<std::size_t>(triangle)])];
  }
  /// Box of the mesh's vertices that belong to triangles; empty without triangles.
  [[nodiscard]] const Eigen::AlignedBox3d& bounds() const { return bounds_; }

 private:
  /// Box seen from above and highest z, relative to the grid's origin, rounded outwards.
  struct Reach {
    float x_min, x_max, y_min, y_max, z_max;
  };
  /// Grid whose cells are no smaller than its triangles, each stored in the cell of its box's
  /// centre.
  struct Level {
    double cell = 0.0;  ///< Side of a cell, mm.
    int columns = 0;
    int rows = 0;
    std::vector<std::int64_t> begin;  ///< First item of each cell, row by row, and the end.
    std::vector<Reach> reach;         ///< Of all items of a cell.
  };
  struct Item {
    FacetContact facet;
    ContactFeatures features = 0;
  };
  struct Search;

  void lay_out_levels(double finest_cell, double largest_extent);
  void sort_into_cells(const SurfaceMesh& mesh, const std::vector<double>& extents);
  void fill_items(const SurfaceMesh& mesh, const Executor& executor);
  void bound_cells();
  [[nodiscard]] double floor_between(const Eigen::Vector2d& from, const CutterLocation& at_from,
                                     const Eigen::Vector2d& to, const CutterLocation& at_to) const;
  template <class Visit>
  void visit_cells(const Level& level, const Eigen::AlignedBox2d& axis, const Visit& visit) const;
  void search_level(const Level& level, Search& search) const;
  void search_cell(const Level& level, std::size_t cell, Search& search) const;
  void try_item(std::size_t item, Search& search) const;
  void try_boundary(std::size_t item, const Barycentric& at, Search& search) const;

  double radius_;
  Eigen::AlignedBox3d bounds_;
  std::vector<Level> levels_;
  // Items are triangles in the order of levels and cells; all of the same length.
  std::vector<Reach> reach_;
  std::vector<Item> items_;
  std::vector<Eigen::Matrix3d> corners_;  ///< Columns a, b, c; bc is the longest side.
  std::vector<std::int32_t> triangle_of_;
  std::vector<std::int32_t> item_of_;  ///< Inverse of triangle_of_.
};

}  // namespace lensforge
