// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "cam/contact/ball_cutter.h"
#include "cam/workshop/tool.h"

/// A vertical cutter of any profile against points, edges and facets.
///
/// Notation: g(d) height of the profile above the tip at distance d from the axis, p = (x, y)
/// position of the axis. A point q holds the tool up at f(q) = q.z − g(|q.xy − p|); the answer for
/// a set of points is the largest f over it. g is convex and nowhere falling, so f is concave on a
/// triangle: its maximum is the tangent contact inside the facet, or it lies on an edge.
namespace lensforge {

/// Height of the tip of the tool that rests on point q, mm; kNoContact if q is not under it.
double profile_vertex_tip(const CutterProfile& profile, const Eigen::Vector2d& p,
                          const Eigen::Vector3d& q);

/// Height of the tip of the tool that rests on the segment ab, its ends included, mm; kNoContact if
/// no part of it is under the tool.
double profile_edge_tip(const CutterProfile& profile, const Eigen::Vector2d& p,
                        const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// Height of the tip of the tool that rests on a whole triangle (columns: its corners), mm;
/// kNoContact if no part of it is under the tool. Error against the exact maximum of f: 1e-12 mm
/// for triangles of a few millimetres (ProfileContact.AgreesWithTheBall); on ones steeper than 1 :
/// 1000 it answers for a p within 1e-13 mm.
/// @param enough  where the maximum is lower, mm, any height below it may be answered: sooner.
double profile_triangle_tip(const CutterProfile& profile, const Eigen::Vector2d& p,
                            const Eigen::Matrix3d& corners, double enough = kNoContact);

/// Height of the tip of the tool that rests on a level rectangle `low` … `high` (seen from above)
/// at height z, mm; kNoContact if no part of it is under the tool.
double profile_box_tip(const CutterProfile& profile, const Eigen::Vector2d& p,
                       const Eigen::AlignedBox3d& box);

}  // namespace lensforge
