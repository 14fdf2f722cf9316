// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "cam/post_plans.h"

namespace lensforge::testing {

inline constexpr double kFullTurn = 2.0 * std::numbers::pi;

/// Random moves; each at feed has a feed of its own, by which its motions are found again.
class RandomPath {
 public:
  explicit RandomPath(unsigned seed) : engine_(seed) {}

  std::vector<PathMove> moves(int count) {
    at_ = {0.0, 0.0, 20.0};
    std::vector<PathMove> moves{straight(MoveKind::kRapid, at_)};
    for (int i = 0; i < count; ++i) {
      // No two rapids in a row, which would read back as one, nor one before the last retract.
      const bool after_rapid = moves.back().kind == MoveKind::kRapid || i + 1 == count;
      moves.push_back(next(after_rapid, 100.0 + i));
      at_ = moves.back().end;
    }
    return moves;
  }

 private:
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }

  PathMove next(bool after_rapid, double feed) {
    const double kind = between(0.0, 1.0);
    if (kind < 0.15 && !after_rapid) return straight(MoveKind::kRapid, somewhere(30.0));
    if (kind < 0.3)
      return straight(MoveKind::kPlunge, at_ - Eigen::Vector3d(0, 0, between(0, 3)), feed);
    if (kind < 0.6) return straight(MoveKind::kCut, nearby(), feed);
    return arc(feed);
  }

  Eigen::Vector3d somewhere(double size) {
    return {between(-size, size), between(-size, size), between(-size, size)};
  }

  Eigen::Vector3d nearby() { return at_ + somewhere(std::pow(10.0, between(-5.5, 1.0))); }

  /// Any radius, any sweep, in any plane, with or without a rise; now and then a full circle or
  /// nearly one, or one turned by almost nothing.
  PathMove arc(double feed) {
    const int axis = static_cast<int>(engine_() % 3);
    const bool clockwise = engine_() % 2 == 0;
    const double radius = std::pow(10.0, between(-5.0, 2.0));
    const double begin = between(0.0, kFullTurn);
    double sweep = between(1e-6, kFullTurn);
    if (engine_() % 8 == 0) sweep = kFullTurn;
    if (engine_() % 8 == 0) sweep = kFullTurn * (1.0 - std::pow(10.0, between(-6.0, -1.0)));
    if (engine_() % 8 == 0) sweep = std::pow(10.0, between(-6.0, -1.0));
    const bool full = sweep == kFullTurn;
    if (clockwise) sweep = -sweep;
    const auto on_circle = [&](double angle) {
      Eigen::Vector3d offset = Eigen::Vector3d::Zero();
      offset[(axis + 1) % 3] = radius * std::cos(angle);
      offset[(axis + 2) % 3] = radius * std::sin(angle);
      return offset;
    };
    const Eigen::Vector3d centre = at_ - on_circle(begin);
    Eigen::Vector3d end = full ? at_ : Eigen::Vector3d(centre + on_circle(begin + sweep));
    end[axis] = at_[axis];
    if (engine_() % 3 == 0) end[axis] += between(-0.5, 0.5);
    return arc_move(axis, clockwise, centre, end, feed);
  }

  std::mt19937_64 engine_;
  Eigen::Vector3d at_ = Eigen::Vector3d::Zero();
};

}  // namespace lensforge::testing
