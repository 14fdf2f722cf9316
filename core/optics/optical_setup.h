// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/optics/front_surface.h"
#include "core/optics/outline.h"
#include "core/optics/source_extent.h"
#include "core/optics/spectrum.h"

namespace lensforge {

/// The viewer's side: the lens's side of an opaque wall, or behind a translucent screen.
enum class ViewSide { kFront, kRear };

/// The surface is either the exit face of a lens, with the entry face below it, or a mirror lit
/// from above.
enum class LightMode { kRefract, kReflect };

/// Intensity of a point source by direction: constant, or proportional to the cosine of the angle
/// to the line from the source to the middle of the lens (a flat LED).
enum class Emission { kIsotropic, kLambertian };

struct PointSource {
  Eigen::Vector3d position{0.0, 0.0,
                           0.0};  ///< mm; z < 0 for a lens, above the surface for a mirror.
  Emission emission = Emission::kIsotropic;

  friend bool operator==(const PointSource&, const PointSource&) = default;
};

/// Everything between the lamp and the wall except the surface itself. Millimetres, lens frame.
/// LightPath derives the rays from it.
///
/// The picture lies on the screen, a plane through its centre: image_origin + image_size / 2 in x
/// and y, focal_length in z. screen_x and screen_y give its rotation about that point. Unturned,
/// the screen is the plane z = focal_length, and image_origin the picture's corner of least x and
/// y.
struct OpticalSetup {
  LightMode mode = LightMode::kRefract;
  /// Unit direction of parallel light before the surface: upwards for a lens, downwards for a
  /// mirror.
  Eigen::Vector3d light{0.0, 0.0, 1.0};
  std::optional<PointSource> point;  ///< Instead of parallel light.
  /// Entry face of a lens; none: the plane z = 0.
  std::optional<Front> front;
  SourceExtent extent;  ///< For either kind of source; LightPath treats it as a point.
  Spectrum spectrum;    ///< Light through a lens; LightPath uses ior for all of it.
  /// True: light that a lens's faces reflect is missing behind them; steeper faces transmit less.
  bool fresnel = false;
  double ior = 1.49;                        ///< Refractive index of the lens against air, > 1.
  double focal_length = 300.0;              ///< z of the picture's centre, mm; above the surface.
  Eigen::Vector2d lens_size{100.0, 100.0};  ///< mm
  /// Light passes only inside it; none: the whole rectangle of lens_size.
  std::optional<Outline> outline;
  Eigen::Vector2d image_size{100.0, 100.0};  ///< mm, on the screen
  Eigen::Vector2d image_origin{0.0, 0.0};    ///< mm
  Eigen::Vector3d screen_x{1.0, 0.0, 0.0};   ///< Unit vector on the screen; x if unturned.
  Eigen::Vector3d screen_y{0.0, 1.0, 0.0};   ///< The same for y; perpendicular to screen_x.
  Eigen::Vector2i pixels{256, 256};          ///< columns, rows of the working picture
  ViewSide view = ViewSide::kFront;

  [[nodiscard]] bool screen_is_turned() const {
    return screen_x != Eigen::Vector3d::UnitX() || screen_y != Eigen::Vector3d::UnitY();
  }
  [[nodiscard]] Eigen::Vector3d screen_centre() const {
    return {image_origin.x() + 0.5 * image_size.x(), image_origin.y() + 0.5 * image_size.y(),
            focal_length};
  }

  friend bool operator==(const OpticalSetup&, const OpticalSetup&) = default;
};

/// @throw InputError naming the field, its value and the rule, unless ior > 1, all sizes, the focal
///        length and the pixel counts are positive, the light comes from the right side, the
///        screen's vectors are of length 1, at a right angle and turn it by less than a right
///        angle, a spherical front's radius is longer than half of the lens's diagonal, a height
///        map spans the lens's rectangle, an outline is one closed line inside that rectangle, and
///        everything is finite.
void validate(const OpticalSetup& setup);

}  // namespace lensforge
