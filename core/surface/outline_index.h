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

/// A part of a triangle that is a triangle itself: column k has the barycentric weights of its
/// corner k, counter-clockwise.
struct TrianglePiece {
  Eigen::Matrix3d weights = Eigen::Matrix3d::Identity();
  double share = 1.0;  ///< Of the triangle's area, above 0.
};

/// Quick answers to what lies inside of an outline.
class OutlineIndex {
 public:
  explicit OutlineIndex(const Outline& outline);

  enum class Side { kOutside, kInside, kAcross };

  [[nodiscard]] bool contains(const Eigen::Vector2d& p) const;
  /// Where all of a box lies; kAcross if the box of a side of the outline touches it.
  [[nodiscard]] Side side_of(const Eigen::AlignedBox2d& box) const;
  /// The part of a triangle inside of the outline, exactly, in triangles that do not overlap: one
  /// that is the whole where all of it lies inside, none where nothing does. Shares below
  /// kLeastShare of the triangle count as nothing, and what lacks less than that as whole.
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
  std::vector<std::vector<std::size_t>> slabs_;  ///< Sides that reach into a strip of y.
};

}  // namespace lensforge
