// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>

#include "core/optics/front.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// Of a screen, degrees from the lens's plane, and of light on a mirror: beyond it light grazes.
inline constexpr double kMaxTilt = 80.0;
/// Of a picture on a screen, mm: up to a kilometre.
inline constexpr double kMinImageWidth = 1e-3;
inline constexpr double kMaxImageWidth = 1e6;

/// Of a source's angle, mrad, and size, mm: from a laser's to a lamp that fills half of the sky.
inline constexpr double kMinSourceWidth = 1e-3;
inline constexpr double kMaxSourceAngle = 1500.0;
inline constexpr double kMaxSourceSize = 1e6;

/// Of a spherical front's radius, mm: beyond it the front is flat to a nanometre.
inline constexpr double kMaxFrontRadius = 1e9;

enum class SourceKind { kParallel, kPoint };

/// What lights the surface, what that does to the light, and where the picture is.
struct LightOptions {
  LightMode mode = LightMode::kRefract;
  double incidence = 0.0;  ///< Of parallel light on a mirror, degrees from its z axis, in x.
  SourceKind source = SourceKind::kParallel;
  std::optional<double> front_radius;  ///< Of a spherical front, mm, convex above 0; none: flat.
  std::string front_file;              ///< Of a front that is a height map, which it names.
  std::shared_ptr<const HeightSpline> front_heights;  ///< What that holds.
  std::optional<Eigen::Vector3d> source_position;     ///< Of a point source, mm, lens frame.
  Emission emission = Emission::kIsotropic;           ///< Of a point source.
  double source_angle = 0.0;                          ///< Full angle of parallel light, mrad.
  double source_size = 0.0;                           ///< Diameter of a point source, mm.
  SourceShape source_shape;                           ///< Of a source with an angle or a size.
  bool fresnel = false;                               ///< A lens's faces reflect a part of it.
  Spectrum spectrum;         ///< Its colours; none: all has DesignOptions::ior.
  double image_width = 0.0;  ///< Picture on the screen, mm; 0: the lens's.
  /// From where a flat surface's chief ray meets the screen to the picture's centre, mm along the
  /// lens's x and y.
  Eigen::Vector2d image_offset{0.0, 0.0};
  /// Turns of the screen by the right-hand rule, degrees: about the picture's right, then its up.
  Eigen::Vector2d screen_tilt{0.0, 0.0};
};

}  // namespace lensforge
