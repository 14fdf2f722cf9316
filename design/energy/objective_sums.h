// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "core/compute/host_device.h"

/// Values of the objective's terms that are summed over faces. Executors sum arrays: packed()
/// and of() go from one to the other.
namespace lensforge {

/// What the goal says of one face or of all.
struct GoalSums {
  using Packed = std::array<double, 4>;

  double boundary = 0.0;
  double unlit = 0.0;
  double align = 0.0;
  double flux = 0.0;

  [[nodiscard]] LF_HD Packed packed() const { return {boundary, unlit, align, flux}; }
  [[nodiscard]] static GoalSums of(const Packed& p) { return {p[0], p[1], p[2], p[3]}; }

  LF_HD GoalSums& operator+=(const GoalSums& other) {
    boundary += other.boundary;
    unlit += other.unlit;
    align += other.align;
    flux += other.flux;
    return *this;
  }
};

/// All of it.
struct FaceSums {
  using Packed = std::array<double, 5>;

  GoalSums goal;
  double barrier = 0.0;

  [[nodiscard]] LF_HD Packed packed() const {
    return {goal.boundary, goal.unlit, goal.align, goal.flux, barrier};
  }
  [[nodiscard]] static FaceSums of(const Packed& p) { return {{p[0], p[1], p[2], p[3]}, p[4]}; }
};

}  // namespace lensforge
