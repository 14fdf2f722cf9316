// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace lensforge {

struct NestLayout;

/// A rectangle to be placed on a blank; mm.
struct NestItem {
  std::string name;
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
};

/// The blank and the distances to keep around rectangles; mm.
struct NestSheet {
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
  double gap = 0.0;   ///< Minimum between rectangles.
  double edge = 0.0;  ///< Minimum to the blank's edge.
};

/// Places rectangles in rows along x, the highest first, each in the first row that has room for
/// it. None is turned, because a turned lens would be cut differently.
/// @return their lower left corners from that of the blank, in the order of the items, on whole
///         multiples of kNestStep.
/// @throw InputError naming --blank and a size that works, if they do not fit.
std::vector<Eigen::Vector2d> place_in_rows(const std::vector<NestItem>& items,
                                           const NestSheet& sheet);

/// mm; a whole number of units of any program's last decimal, so that shifted numbers round the
/// same.
inline constexpr double kNestStep = 0.01;

/// The blank seen from above as SVG: lenses with their names and places, the cut around them,
/// clamps, the program's zero. One unit is a millimetre.
std::string nest_svg(const NestLayout& layout);

}  // namespace lensforge
