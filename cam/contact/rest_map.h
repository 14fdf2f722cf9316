// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "cam/contact/smooth_roll.h"
#include "core/compute/executor.h"

namespace lensforge {

/// What a ball leaves of a smooth surface to a smaller one: where it could not roll (SmoothRoll)
/// with a margin, and how far everything else is from there.
class RestMap {
 public:
  /// @param reach  distances are told up to here, mm, > 0; farther places count as so far.
  RestMap(const SmoothBed& bed, double reach, const Executor& executor);

  /// From the nearest place that is left, seen from above, mm; 0 on it. Places beyond the rim count
  /// as the rim's.
  [[nodiscard]] double distance(const Eigen::Vector2d& place) const;
  /// Of the rectangle: how much lies no farther than this from a place that is left, 0 … 1.
  /// @pre distance < reach
  [[nodiscard]] double share_within(double distance) const;

  static constexpr double kCell = 0.1;  ///< Side of the cells that are judged, mm.

 private:
  [[nodiscard]] Eigen::AlignedBox2d box_of(std::int64_t cell) const;
  void spread(std::int64_t reach_cells, const std::vector<std::uint8_t>& left);

  Eigen::AlignedBox2d box_;
  double cell_;
  std::int64_t columns_ = 1;
  std::int64_t rows_ = 1;
  std::vector<float> distance_;  ///< At the middles of the cells, mm.
};

}  // namespace lensforge
