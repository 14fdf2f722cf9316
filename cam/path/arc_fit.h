// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <stop_token>
#include <vector>

#include "cam/path/row_error.h"
#include "cam/path/row_joints.h"
#include "cam/path/row_profile.h"

namespace lensforge {

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
