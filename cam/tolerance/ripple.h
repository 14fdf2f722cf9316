// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "cam/tolerance/passes.h"

namespace lensforge {

/// The slopes across the rows that polishing leaves of a raster's scallops: over a period p, the
/// k-th harmonic of the ball's profile keeps exp(−2π²k²σ²/p²) of its height. Of rows that cross,
/// the mean of what the second raster leaves of each scallop is taken.
class Ripple {
 public:
  /// @param radius  of the ball as it is, mm. @param sigma  of the polish, mm.
  Ripple(const Passes& passes, double radius, double sigma);

  /// Slope (rise over run) at a place across the rows on a surface of this slope, mm. A ball over
  /// row y touches the surface at y + R s / √(1 + |s|²), where its scallops then are lowest; the
  /// ball's own bend, and so the ripple, is (1 + s²) √(1 + |s|²) times as strong there.
  /// @param across  of the two axes the one that the ripple runs along.
  [[nodiscard]] double slope(double place, const Eigen::Vector2d& surface, int across) const;

  /// What is left of the ripple where σ is this many times its mean, of what is left elsewhere: by
  /// its first harmonic.
  [[nodiscard]] double kept(double factor) const;

  /// Mean of a wave as long as a pitch over a disc of this radius, mm, as a share of the wave:
  /// 2 J₁(x) / x with x = 2π radius / p.
  [[nodiscard]] double seen_by_disc(double radius) const;

  /// Largest slope; rows that lie closer than σ leave next to none.
  [[nodiscard]] double largest() const { return largest_; }

 private:
  double pitch_;
  double radius_;
  double sigma_;
  double sign_;  ///< −1 in a mould, where rows leave ridges.
  double largest_ = 0.0;
  std::vector<double> slope_;  ///< At equal parts of a period, from the lowest place on.
};

}  // namespace lensforge
