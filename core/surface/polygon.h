// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace lensforge {

/// Cuts a polygon into triangles of its orientation, as corner numbers: a convex one into the fan
/// around its first corner, any other by clipping ears (Meisters, "Polygons have ears", 1975) in
/// quadratic time. Triangles of zero area occur only if no cut avoids them; the cut of a polygon
/// that crosses itself is arbitrary.
/// @param corners  3 × n, n ≥ 3, finite; projected along the axis nearest to the normal.
/// @return n − 2 triangles.
std::vector<Eigen::Vector3i> polygon_triangles(const Eigen::Matrix3Xd& corners);

}  // namespace lensforge
