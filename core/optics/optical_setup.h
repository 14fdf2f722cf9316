// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace lensforge {

/// From where the picture is looked at: from the lens's side on an opaque wall, or from behind a
/// translucent screen.
enum class ViewSide { kFront, kRear };

/// Everything between the lamp and the wall but the surface itself. Millimetres, lens frame: the
/// flat entry face lies in z = 0, the receiving plane is z = focal_length. What follows from it for
/// a ray is asked of LightPath.
struct OpticalSetup {
  Eigen::Vector3d light{0.0, 0.0, 1.0};  ///< Unit direction of the parallel light before the lens.
  double ior = 1.49;                     ///< Refractive index of the lens against air, > 1.
  double focal_length = 300.0;           ///< z of the receiving plane, mm; above the surface.
  Eigen::Vector2d lens_size{100.0, 100.0};   ///< mm
  Eigen::Vector2d image_size{100.0, 100.0};  ///< mm, on the receiving plane
  Eigen::Vector2d image_origin{0.0, 0.0};    ///< mm, corner of least x and y
  Eigen::Vector2i pixels{256, 256};          ///< columns, rows of the working picture
  ViewSide view = ViewSide::kFront;

  friend bool operator==(const OpticalSetup&, const OpticalSetup&) = default;
};

/// @throw InputError naming the field, its value and the rule, unless ior > 1, all sizes, the focal
/// length and the pixel counts are positive, the light is a unit vector of z > 0, and everything is
/// finite.
void validate(const OpticalSetup& setup);

}  // namespace lensforge
