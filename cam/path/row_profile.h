// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "cam/contact/curve_piece.h"
#include "cam/contact/drop_cutter.h"

namespace lensforge {

/// Where a row runs: over the whole of from … to, along the drop curve on held_from … held_to and
/// level beyond.
struct RowSpan {
  AxisLine line;  ///< Over which the drop curve is taken.
  double from = 0.0, to = 0.0;
  double held_from = 0.0, held_to = 0.0;
};

/// The drop curve of a row as a polyline that is nowhere farther from it than `error`, an upper
/// bound: what fits and certificates are made against.
struct RowProfile {
  std::vector<double> u;  ///< Ascending, mm.
  std::vector<double> z;  ///< mm
  /// Where moves may well begin and end, ascending: where the curve goes over from one piece to the
  /// next, and on its arcs so close that chords between them are `bow` off.
  std::vector<double> joints;
  double error = 0.0;  ///< mm

  /// Height on the polyline. `hint` is where the search begins and the segment it ended in.
  [[nodiscard]] double at(double place, std::size_t& hint) const;
};

/// Farthest that the polyline of a profile may be off, mm: both ends of a kSlopeStretch then add
/// 2e-5 rad to a certificate. Reached but on walls steeper than 1 : 1000.
inline constexpr double kProfileError = 5e-8;

/// @param bow  of chords between joints on arcs at most, about, mm, > 0.
/// @throw InputError if there is nothing under the ball somewhere on the row.
RowProfile row_profile(const DropCutter& cutter, const RowSpan& span, double bow);

}  // namespace lensforge
