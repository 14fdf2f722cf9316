// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/milled/surface_field.h"
#include "core/compute/executor.h"

namespace lensforge {

/// Where two smooth pieces of surface meet between two points, as a share of the way from the first
/// to the second. @param at_first  height of the second's piece, continued, above the first's, at
/// the first point. @param at_second  likewise at the second point.
///
/// The difference of their heights is linear along the way for two cuts of one ball, so its zero is
/// exact there. Without a change of sign the pieces touch (a fillet that runs into a face): the
/// difference is a parabola on its double root, which its square roots find.
double meeting_share(double at_first, double at_second);

/// Changes the heights of a patch beside creases so that sums of them with smooth weights (what
/// polishing is) tell where the crease runs between its two nodes.
///
/// The sum over nodes h apart of a smooth function is its integral, but for what is exponentially
/// small; a crease at θh behind a node, where the slope jumps by J, adds to its integral
///
///     −½ J h² B₂(θ) w + ⅓ J h³ B₃(θ) w′ + O(h⁴)     (Euler–Maclaurin, ends at the crease)
///
/// with the weight w and its derivative there and the Bernoulli polynomials B₂, B₃. The scallops'
/// crests wander over the nodes as the surface tilts, and the first term is a wave with the length
/// of that: a slope off by up to ½ h times the curvature. Both terms are taken from the heights of
/// the two nodes. A crease counts along that axis of the grid along which more of its jump lies:
/// what is summed along one axis is smooth along the other unless the crease runs along the first.
///
/// Heights of the two nodes next to a border of the window, but for a border of the lens, lack what
/// lies beyond. Does nothing to a patch without pieces.
void correct_crease_sums(const Executor& executor, SurfacePatch& patch);

/// How many nodes next to a window's border these are.
inline constexpr std::int64_t kCreaseHalo = 2;

}  // namespace lensforge
