// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <vector>

#include "core/optics/outline.h"

namespace lensforge {

/// A triangle seen along z, counter-clockwise, mm.
using PlanTriangle = std::array<Eigen::Vector2d, 3>;

Eigen::AlignedBox2d box_of(const PlanTriangle& t);

/// A triangular part of a triangle: column k holds the barycentric weights of its corner k,
/// counter-clockwise.
struct TrianglePiece {
  Eigen::Matrix3d weights = Eigen::Matrix3d::Identity();
  double share = 1.0;  ///< Share of the triangle's area, > 0.
};

/// Spatial index for the inside of an outline.
class OutlineIndex {
 public:
  explicit OutlineIndex(const Outline& outline);

  enum class Side { kOutside, kInside, kAcross };

  [[nodiscard]] bool contains(const Eigen::Vector2d& p) const;
  /// Side of the outline on which a box lies; kAcross if the bounding box of one of the outline's
  /// sides touches it.
  [[nodiscard]] Side side_of(const Eigen::AlignedBox2d& box) const;
  /// The exact part of a triangle inside the outline, as triangles that do not overlap: the whole
  /// triangle if all of it is inside, none if nothing is. A share below kLeastShare counts as
  /// nothing; a share less than that short of the whole counts as whole.
  [[nodiscard]] std::vector<TrianglePiece> inside(const PlanTriangle& t) const;

  static constexpr double kLeastShare = 1e-12;

 private:
  [[nodiscard]] int slab_of(double y) const;
  [[nodiscard]] const Eigen::Vector2d& start(std::size_t side) const { return points_[side]; }
  [[nodiscard]] const Eigen::Vector2d& end(std::size_t side) const {
    return points_[side + 1 < points_.size() ? side + 1 : 0];
  }

  std::vector<Eigen::Vector2d> points_;
  double low_ = 0.0;                             ///< Least y, mm.
  double step_ = 1.0;                            ///< Height of a slab, mm.
  std::vector<std::vector<std::size_t>> slabs_;  ///< Sides that reach into each strip of y.
};

}  // namespace lensforge
