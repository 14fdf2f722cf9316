// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <numbers>

namespace lensforge {

/// The light with which a coupon's orders of diffraction are measured, through the blank.
struct CouponLight {
  double wavelength = 532e-6;  ///< In air, mm.
  double ior = 1.49;           ///< Of the blank.

  /// By how much a millimetre of the blank delays the light against air, rad/mm.
  [[nodiscard]] double phase() const { return 2.0 * std::numbers::pi * (ior - 1.0) / wavelength; }
};

}  // namespace lensforge
