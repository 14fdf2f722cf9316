// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <span>

namespace lensforge {

/// Thicknesses in which sheets of acrylic are sold, mm.
inline constexpr std::array kSheetsOnSale{2.0,  3.0,  4.0,  5.0,  6.0,  8.0,
                                          10.0, 12.0, 15.0, 20.0, 25.0, 30.0};

/// The thinnest of these sheets that is as high as a blank; 0 if none is. mm
inline double thinnest_sheet(std::span<const double> sheets, double height) {
  double thinnest = 0.0;
  for (const double sheet : sheets) {
    if (sheet >= height && (thinnest == 0.0 || sheet < thinnest)) thinnest = sheet;
  }
  return thinnest;
}

}  // namespace lensforge
