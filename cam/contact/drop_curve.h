// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "cam/contact/curve_piece.h"
#include "cam/contact/drop_cutter.h"

namespace lensforge {

/// The height of a ball's tip along a line as what it is: the largest of the curves on which single
/// facets (straight), edges (arcs of ellipses) and vertices (arcs of circles) hold the ball.
///
/// The pieces lie in order; where nothing is under the ball there are none. Equal to
/// DropCutter::drop() everywhere to 1e-9 mm (DropCurve.EqualsTheDropCutter…): 1e-12 but where a
/// wall falls off steeper than the ball's own flank.
std::vector<CurvePiece> drop_curve(const DropCutter& cutter, const AxisLine& line, double from,
                                   double to);

}  // namespace lensforge
