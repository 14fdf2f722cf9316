// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/optics/front_surface.h"
#include "core/optics/outline.h"
#include "core/optics/source_extent.h"
#include "core/optics/spectrum.h"

namespace lensforge {

/// From where the picture is looked at: from the lens's side on an opaque wall, or from behind a
/// translucent screen.
enum class ViewSide { kFront, kRear };

/// What the surface does to the light: it lets it out of a lens, whose entry face lies below it, or
/// it is a mirror, lit from above.
enum class LightMode { kRefract, kReflect };

/// How the intensity of a point source depends on the direction: the same in all of them, or by the
/// cosine to the line from the source to the middle of the lens, as of a flat LED.
enum class Emission { kIsotropic, kLambertian };

struct PointSource {
  Eigen::Vector3d position{0.0, 0.0,
                           0.0};  ///< mm; z < 0 for a lens, above the surface for a mirror.
  Emission emission = Emission::kIsotropic;

  friend bool operator==(const PointSource&, const PointSource&) = default;
};

/// Everything between the lamp and the wall but the surface itself. Millimetres, lens frame. What
/// follows from it for a ray is asked of LightPath.
///
/// The picture lies on the screen, a plane through its centre: image_origin + image_size / 2 in x
/// and y, focal_length in z. screen_x and screen_y say how it is turned about that point; unturned,
/// the screen is the plane z = focal_length, and image_origin the picture's corner of least x and
/// y.
struct OpticalSetup {
  LightMode mode = LightMode::kRefract;
  /// Unit direction of parallel light before the surface; up for a lens, down for a mirror.
  Eigen::Vector3d light{0.0, 0.0, 1.0};
  std::optional<PointSource> point;  ///< Instead of parallel light.
  /// Entry face of a lens; none: the plane z = 0.
  std::optional<Front> front;
  SourceExtent extent;  ///< Of either; LightPath takes it for a point.
  Spectrum spectrum;    ///< Of the light through a lens; LightPath takes all of it for that of ior.
  /// Light that a lens's faces reflect is missing behind them, steeper ones let less through.
  bool fresnel = false;
  double ior = 1.49;                        ///< Refractive index of the lens against air, > 1.
  double focal_length = 300.0;              ///< z of the picture's centre, mm; above the surface.
  Eigen::Vector2d lens_size{100.0, 100.0};  ///< mm
  /// Light passes inside of it only; none: the whole rectangle of lens_size.
  std::optional<Outline> outline;
  Eigen::Vector2d image_size{100.0, 100.0};  ///< mm, on the screen
  Eigen::Vector2d image_origin{0.0, 0.0};    ///< mm
  Eigen::Vector3d screen_x{1.0, 0.0, 0.0};   ///< Unit vector on the screen, x of an unturned one.
  Eigen::Vector3d screen_y{0.0, 1.0, 0.0};   ///< The same of y; at a right angle to screen_x.
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
/// length and the pixel counts are positive, the light comes from the right side, the screen's
/// vectors are of length 1, at a right angle and turn it by less than a right angle, a spherical
/// front's radius is longer than half of the lens's diagonal, a height map spans the lens's
/// rectangle, an outline is one closed line inside of that rectangle, and everything is finite.
void validate(const OpticalSetup& setup);

}  // namespace lensforge
