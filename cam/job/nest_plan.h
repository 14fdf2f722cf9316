// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace lensforge {

struct NestLayout;

/// A rectangle that is to lie on a blank; mm.
struct NestItem {
  std::string name;
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
};

/// The blank and what of it has to stay around rectangles; mm.
struct NestSheet {
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
  double gap = 0.0;   ///< Between rectangles, at least.
  double edge = 0.0;  ///< Between them and the blank's edge, at least.
};

/// Places rectangles in rows along x, the highest first, each in the first row that has room for
/// it; none is turned, since the cut of a turned lens would be another one.
/// @return their lower left corners from that of the blank, in the order of the items, on whole
///         multiples of kNestStep.
/// @throw InputError naming --blank and a size that would do, if they do not fit.
std::vector<Eigen::Vector2d> place_in_rows(const std::vector<NestItem>& items,
                                           const NestSheet& sheet);

/// mm; a whole number of units of any program's last decimal, so that moved numbers are rounded as
/// they were.
inline constexpr double kNestStep = 0.01;

/// The blank seen from above as SVG: lenses with their names and places, the cut around them,
/// clamps, the program's zero. One unit is a millimetre.
std::string nest_svg(const NestLayout& layout);

}  // namespace lensforge
