// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "cam/path/row_profile.h"

namespace lensforge {

/// The value on the program's grid that is nearest to `value` mm.
double to_resolution(double value, double resolution);

/// The numbers that a program can hold.
struct ProgramGrid {
  double resolution = 1e-6;  ///< Unit of the last decimal, mm.
  double z_zero = 0.0;       ///< Height that the program calls 0, mm.

  [[nodiscard]] double place(double u) const { return to_resolution(u, resolution); }
  [[nodiscard]] double height(double z) const {
    return z_zero + to_resolution(z - z_zero, resolution);
  }
};

/// Where moves may begin and end, ascending along the row, each place on the grid once.
struct RowJoints {
  std::vector<Eigen::Vector2d> exact;    ///< On the drop curve.
  std::vector<Eigen::Vector2d> written;  ///< On the program's grid.
  std::vector<double> height;            ///< Of the drop curve at the written places.
};

/// The joints of a profile, moved to where the drop curve's height is one that the program can
/// hold: half a unit of the sixth decimal at both ends of a kSlopeStretch is 0.2 mrad, and a move
/// that begins with such an error hands it on to the next.
RowJoints row_joints(const RowProfile& profile, const ProgramGrid& grid);

/// Lets the level ends of a profile begin a little earlier, where the drop curve's height is one
/// that the program can hold: the corners there can be left by no other way.
/// @pre the profile is that of RowCurves::profile(): its first and last pieces are level.
void level_ends(const ProgramGrid& grid, RowProfile& profile);

}  // namespace lensforge
