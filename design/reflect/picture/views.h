// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/compute/executor.h"
#include "core/image/image_io.h"
#include "core/mesh/surface_mesh.h"
#include "design/reflect/light/light_field.h"

namespace lensforge::reflect {

/// Two shapes of the same faces in unit frame: as it came, and the new one.
struct ShapePair {
  const SurfaceMesh& before;
  const SurfaceMesh& after;
};

/// What the sensor sees of both shapes from eight directions around the z axis, before above after,
/// all with the same scale: for stealth the light of a lamp beside the eye; for other goals the
/// light that goes to their place, averaged over the sun's positions, on the shape seen from there
/// and around. White is the radiance of kWhiteRadiance. @throw Interrupted
ColorImage retroreflection_views(const ShapePair& shapes, const LightField& field,
                                 const Executor& executor);

/// How far every vertex moved, in false colour from eight directions; the brightest colour is the
/// largest displacement.
ColorImage displacement_views(const ShapePair& shapes, const Executor& executor);

/// Radiance that is shown as white: half of what a mirror-like facet sends straight back.
inline constexpr double kWhiteRadiance = 2.0;

}  // namespace lensforge::reflect
