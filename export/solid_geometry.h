// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Geom_BSplineSurface.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <gp_Sphere.hxx>

#include "core/optics/front_surface.h"
#include "export/spline_net.h"

/// Splines and fronts in OpenCASCADE's terms.
namespace lensforge {

inline constexpr int kSplineDegree = 3;

/// The knots of `cells` cells of one width, each once; clamped_multiplicities() says how often.
TColStd_Array1OfReal even_knots(double from, double to, int cells);
TColStd_Array1OfInteger clamped_multiplicities(int cells);

Handle(Geom_BSplineSurface) surface_of(const SplinePatch& patch);

/// The sphere of a front. Its poles and its seam lie beside the lens: the axis runs along y, and
/// angles count from the side of the centre that is away from the apex.
gp_Sphere sphere_of(const SphericalFront& front);

}  // namespace lensforge
