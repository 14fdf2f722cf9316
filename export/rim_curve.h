// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Geom2d_BSplineCurve.hxx>
#include <Geom_BSplineCurve.hxx>
#include <functional>

#include "core/optics/front_surface.h"

namespace lensforge {

/// A point of an edge, its place on a face, and the derivatives of both by the edge's parameter.
struct RimPoint {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< mm
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();  ///< The face's own parameters.
  Eigen::Vector2d turn = Eigen::Vector2d::Zero();
};

/// An edge in space and in the plane of a face's parameters, with one parameter.
struct RimCurve {
  Handle(Geom_BSplineCurve) space;
  Handle(Geom2d_BSplineCurve) plan;
};

/// How far a rim's curves may be from the rim and from each other, mm; a tenth of the light's
/// wavelength is five times as much. rim_curve() stays at a quarter of it between its points.
inline constexpr double kRimTolerance = 2e-5;

/// Cubic splines through points of an edge, at first over `pieces` equal parts, until they are as
/// near as kRimTolerance asks for, or kMostPieces. @param last  parameter of the end, 0 the
/// start's.
RimCurve rim_curve(const std::function<RimPoint(double)>& at, double last, int pieces);

/// Of one wall: with 16 a knot cell it needs no more on any lens measured.
inline constexpr int kMostPieces = 16384;

/// The curve on a vertical cylinder whose angles run with the edge's parameter.
/// @param angle  at the start. @pre the cylinder's origin is at z = 0.
Handle(Geom2d_BSplineCurve) unrolled(const RimCurve& curve, double angle);

/// A point of a front with its parameters on sphere_of().
RimPoint point_on_sphere(const SphericalFront& front, const Eigen::Vector3d& point,
                         const Eigen::Vector3d& along);

}  // namespace lensforge
