// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace lensforge {

/// Cuts a polygon into triangles, as numbers of its corners, which keep its sense: a convex one
/// into the fan around its first corner, any other by clipping ears (Meisters, "Polygons have
/// ears", 1975) in a time that grows with the square of its corners. No triangle is without area
/// where another cut has none; a polygon that crosses itself is cut somehow.
/// @param corners  3 × n, n ≥ 3, finite; looked at along the axis nearest to the normal.
/// @return n − 2 triangles.
std::vector<Eigen::Vector3i> polygon_triangles(const Eigen::Matrix3Xd& corners);

}  // namespace lensforge
