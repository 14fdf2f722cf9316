// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <stop_token>
#include <vector>

#include "cam/path/row_profile.h"

namespace lensforge {

/// The value on the program's grid nearest to `value`, mm.
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

/// Possible ends of moves, ascending along the row, each place on the grid once.
struct RowJoints {
  std::vector<Eigen::Vector2d> exact;    ///< On the drop curve.
  std::vector<Eigen::Vector2d> written;  ///< On the program's grid.
  std::vector<double> height;            ///< Of the drop curve at the written places.
};

/// The joints of a profile, moved to places where the drop curve's height is on the program's grid:
/// half a unit of the sixth decimal at both ends of a kSlopeStretch is 0.2 mrad, and a move that
/// begins with such an error passes it on to the next.
RowJoints row_joints(const RowProfile& profile, const ProgramGrid& grid);

/// Moves the beginnings of a profile's level ends inwards to where the drop curve's height is on
/// the program's grid; otherwise no move could leave the corners there.
/// @pre the profile is that of RowCurves::profile(): its first and last pieces are level.
void level_ends(const ProgramGrid& grid, RowProfile& profile);

/// Tolerances of a row's fit, and the numbers that a program can hold.
struct RowFitOptions {
  double tolerance = 0.0005;      ///< Farthest from the drop curve, mm.
  double slope_tolerance = 1e-3;  ///< Largest difference of slope over a kSlopeStretch.
  ProgramGrid grid;
  bool arcs = false;      ///< True if moves may be circular arcs.
  double shortest = 0.0;  ///< Shortest move to aim for, mm, ≥ 0: shorter ones overload controllers.
  std::stop_token stop = {};  ///< Ends the fit.
};

/// Maximum radius of an arc, mm: a controller with single precision places a point of it to a tenth
/// of a micrometre.
inline constexpr double kLargestArc = 1000.0;

/// Path along a row.
struct RowWay {
  Eigen::Vector2d start = Eigen::Vector2d::Zero();
  std::vector<RowMove> moves;
};

struct FittedRow : RowWay {
  RowWay unrounded;             ///< The same moves before their numbers are rounded.
  PathCertificate certificate;  ///< RowError::certificate() of the rounded ones.
};

/// Covers a row's drop curve with straight moves and arcs, greedily: each move reaches about the
/// farthest joint within the tolerances. Moves begin and end on the drop curve to the resolution.
/// They hold the tolerances over their whole length (RowError) unless rounding turns even the move
/// to the next joint too far; the certificate then states the result. A move shorter than
/// `shortest` is merged with the one before and both are divided anew; if it stays shorter than
/// half of `shortest`, a longer move with a larger slope error replaces it, which the certificate
/// includes.
FittedRow fit_row(const RowProfile& profile, const RowFitOptions& options);

/// The path of fit_row() alone.
RowWay fit_way(const RowProfile& profile, const RowFitOptions& options);

/// Error allowed to straight moves between joints, mm.
double joint_bow(const RowFitOptions& options);

}  // namespace lensforge
