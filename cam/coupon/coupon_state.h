// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/coupon/coupon_light.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// What decides how a coupon measures; mm.
struct CouponState {
  double sigma = 0.0;          ///< Of the polish.
  double radius = 0.2;         ///< Of the ball as it cuts, run-out and wear included.
  double pitch_error = 0.0;    ///< Share of a length, across the passes.
  double groove_offset = 0.0;  ///< How much deeper grooves are than programmed: the touch-off.

  /// As the workshop's file has it.
  static CouponState of(const Workshop& workshop);

  // What is measured of what was programmed.
  [[nodiscard]] double mark_distance(double programmed) const;
  [[nodiscard]] double groove_width(double depth) const;
  [[nodiscard]] double scallop_before(double pitch) const;
  [[nodiscard]] double scallop_after(double pitch) const;
  [[nodiscard]] double order_ratio(double pitch, const CouponLight& light) const;
};

}  // namespace lensforge
