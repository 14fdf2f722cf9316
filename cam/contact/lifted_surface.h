// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "cam/contact/ball_blend.h"
#include "cam/contact/cut_surface.h"
#include "cam/contact/rest_map.h"

namespace lensforge {

/// How one of two balls is held (BallBlend) over a surface that they share (RestMap). Both must
/// outlive the lift.
class SharedLift final : public BallLift {
 public:
  enum class Ball { kSmall, kLarge };

  SharedLift(const RestMap& rest, const BallBlend& blend, Ball ball)
      : rest_(rest), blend_(blend), ball_(ball) {}

  /// The smaller ball touches so near to its axis that the axis tells as much, also where it
  /// follows facets.
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
