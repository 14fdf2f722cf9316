// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "cam/contact/smooth_roll.h"
#include "core/compute/executor.h"

namespace lensforge {

/// Where a ball that is tangent to a smooth surface certainly cuts nothing of it.
///
/// Where no second derivative of the surface under the ball exceeds 1/R, the height at which a
/// point of the surface holds the ball is concave in that point (SmoothBed), so that the one where
/// the ball is tangent holds it highest.
class SmoothReach {
 public:
  SmoothReach(const SmoothBed& bed, const Executor& executor);

  /// @param centre  of the ball, seen from above.
  [[nodiscard]] bool surely_free(const Eigen::Vector2d& centre) const {
    return free_[static_cast<std::size_t>(row_of(centre.y()) * columns_ + column_of(centre.x()))] !=
           0;
  }

 private:
  [[nodiscard]] static std::int64_t cell_of(double at, double begin, double cell,
                                            std::int64_t cells);
  [[nodiscard]] std::int64_t column_of(double x) const {
    return cell_of(x, box_.min().x(), cell_, columns_);
  }
  [[nodiscard]] std::int64_t row_of(double y) const {
    return cell_of(y, box_.min().y(), cell_, rows_);
  }

  Eigen::AlignedBox2d box_;
  double cell_ = 0.0;
  std::int64_t columns_ = 1;
  std::int64_t rows_ = 1;
  std::vector<std::uint8_t> free_;  ///< Of balls with their centres in a cell.
};

}  // namespace lensforge
