// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/contact/smooth_roll.h"
#include "core/compute/executor.h"

namespace lensforge {

/// The part of a smooth surface that a ball leaves to a smaller one: where it cannot roll
/// (SmoothRoll), with a margin; and the distance of every place from it.
class RestMap {
 public:
  /// @param reach  maximum distance computed, mm, > 0; farther places get this value.
  RestMap(const SmoothBed& bed, double reach, const Executor& executor);

  /// Distance to the nearest place that is left, seen from above, mm; 0 on it. Places beyond the
  /// rim use the nearest on it.
  [[nodiscard]] double distance(const Eigen::Vector2d& place) const;
  /// Share of the rectangle within this distance of a place that is left, 0 … 1.
  /// @pre distance < reach
  [[nodiscard]] double share_within(double distance) const;

  static constexpr double kCell = 0.1;  ///< Side of the cells, mm.

 private:
  [[nodiscard]] Eigen::AlignedBox2d box_of(std::int64_t cell) const;
  void spread(std::int64_t reach_cells, const std::vector<std::uint8_t>& left);

  Eigen::AlignedBox2d box_;
  double cell_;
  std::int64_t columns_ = 1;
  std::int64_t rows_ = 1;
  std::vector<float> distance_;  ///< At the middles of the cells, mm.
};

/// Shares a surface between two balls without a step where one takes over from the other.
///
/// Rows leave scallops, on average p²/(24 R) high, so the surfaces of the two balls have different
/// mean heights, and the surface is lower where both cut. Therefore both are held above the surface
/// by amounts that depend on the distance from what the larger ball leaves (RestMap). The smaller
/// ball cuts on the surface there and rises by a few micrometres outwards; the larger ball's height
/// farther out matches its scallops, and it rises to the smaller one's crests inwards. In between
/// their common lower envelope has the same mean everywhere, p²/(24 r). Rows of the larger ball
/// coincide with every n-th row of the smaller one, since other pitches would beat.
///
/// Notation: p pitch of the smaller ball, n rows of it per row of the larger, R, r radii.
class BallBlend {
 public:
  struct Rows {
    double small_radius = 0.0;  ///< mm
    double large_radius = 0.0;  ///< mm
    double pitch = 0.0;         ///< Of the smaller ball, mm.
    int every = 1;              ///< n
  };

  explicit BallBlend(const Rows& rows);

  /// Lift of either ball above its drop curve where it touches `distance` mm from what the larger
  /// one leaves, mm, ≥ 0.
  [[nodiscard]] double small_lift(double distance) const;
  [[nodiscard]] double large_lift(double distance) const;

  /// Width of the zone where both cut, mm: five cells of the map.
  static constexpr double kWidth = 0.5;
  /// The smaller ball's rows end this far beyond it, where it is clear of the surface.
  static constexpr double kRunOut = 0.2;

 private:
  double clear_ = 0.0;              ///< Of the smaller ball at kWidth, mm.
  std::vector<double> large_lift_;  ///< At even distances 0 … kWidth.
};

/// Lift (BallBlend) of one of two balls over a surface that they share (RestMap). Both must outlive
/// the lift.
class SharedLift final : public BallLift {
 public:
  enum class Ball { kSmall, kLarge };

  SharedLift(const RestMap& rest, const BallBlend& blend, Ball ball)
      : rest_(rest), blend_(blend), ball_(ball) {}

  /// The smaller ball's contact is so close to its axis that the axis is used instead, also on
  /// facets.
  [[nodiscard]] double at(const Eigen::Vector2d& axis,
                          const Eigen::Vector2d& contact) const override {
    return ball_ == Ball::kLarge ? blend_.large_lift(rest_.distance(contact))
                                 : blend_.small_lift(rest_.distance(axis));
  }
  [[nodiscard]] bool clears() const override { return ball_ == Ball::kLarge; }

 private:
  const RestMap& rest_;
  const BallBlend& blend_;
  Ball ball_;
};

/// A surface over which a ball is lifted. Both must outlive it.
class LiftedSurface final : public CutSurface {
 public:
  LiftedSurface(const CutSurface& surface, const BallLift& lift) : surface_(surface), lift_(lift) {}

  [[nodiscard]] std::shared_ptr<const DropCutter> cutter(const Eigen::AlignedBox2d& axis,
                                                         const Executor& executor) const override {
    return surface_.cutter(axis, executor);
  }
  [[nodiscard]] double radius() const override { return surface_.radius(); }
  [[nodiscard]] const SmoothBed* bed() const override { return surface_.bed(); }
  [[nodiscard]] SurfaceDeviation deviation() const override { return surface_.deviation(); }
  [[nodiscard]] double band() const override { return surface_.band(); }
  [[nodiscard]] const BallLift* lift() const override { return &lift_; }

 private:
  const CutSurface& surface_;
  const BallLift& lift_;
};

}  // namespace lensforge
