// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <stop_token>
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

/// How closely moves follow a row's drop curve, and what numbers a program can hold.
struct RowFitOptions {
  double tolerance = 0.0005;      ///< Farthest from the drop curve, mm.
  double slope_tolerance = 1e-3;  ///< Largest difference of slope over a kSlopeStretch.
  ProgramGrid grid;
  bool arcs = false;          ///< Whether moves may be arcs of circles.
  double shortest = 0.0;      ///< Moves should not be shorter, mm, ≥ 0: controllers fall behind.
  std::stop_token stop = {};  ///< Ends the fit.
};

/// Radius of an arc at most, mm: a controller that reckons in single precision places a point of it
/// to a tenth of a micrometre.
inline constexpr double kLargestArc = 1000.0;

/// A way along a row.
struct RowWay {
  Eigen::Vector2d start = Eigen::Vector2d::Zero();
  std::vector<RowMove> moves;
};

struct FittedRow : RowWay {
  RowWay unrounded;             ///< The same moves before their numbers are rounded.
  PathCertificate certificate;  ///< RowError::certificate() of the rounded ones.
};

/// Covers a row's drop curve with straight moves and arcs, greedily: from every end a move that
/// reaches about the farthest joint within the tolerances. Moves begin and end on the drop curve to
/// the resolution, and hold the tolerances over their whole length (RowError) unless not even the
/// way to the next joint does, because rounding turns it: the certificate says what came of it.
/// Where a move ends up shorter than `shortest`, it shares the way of the one before; where it
/// stays shorter than half of that, a longer one that turns off farther takes its place, as the
/// certificate says.
FittedRow fit_row(const RowProfile& profile, const RowFitOptions& options);

/// The way of fit_row() alone.
RowWay fit_way(const RowProfile& profile, const RowFitOptions& options);

/// How far straight moves between joints may be off.
double joint_bow(const RowFitOptions& options);

}  // namespace lensforge
