// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "cam/tolerance/part_error.h"
#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"
#include "core/surface/corners.h"

namespace lensforge {

/// The light's way through a part that stands, is made of and is lit as its errors say: turned
/// about its centre, with another refractive index, grown, before a screen that is farther. Lamp
/// and screen stay where they are.
class PartLight {
 public:
  PartLight(const OpticalSetup& setup, const PartError& error);

  /// A point of the part as it has grown, from its place and height in the lens frame, mm.
  [[nodiscard]] Eigen::Vector3d grown(const Eigen::Vector2d& place, double z) const {
    return centre_ + growth_ * (Eigen::Vector3d(place.x(), place.y(), z) - centre_);
  }
  /// Where the ray of such a point lands, in pixel coordinates; NaN if it is reflected totally.
  [[nodiscard]] Eigen::Vector2d land(const Eigen::Vector3d& point,
                                     const Eigen::Vector2d& slope) const;
  /// Light that a triangle of such points takes, mm² (LightPath::intake()).
  [[nodiscard]] double intake(const Corners& triangle) const { return light_.intake(triangle); }
  /// Area of the lens as it has grown, mm².
  [[nodiscard]] double lens_area() const { return lens_area_; }
  /// How far a change of slope along an axis moves the light over the screen, pixels; NaN where
  /// none leaves.
  [[nodiscard]] Eigen::Vector2d moved_by(const Eigen::Vector3d& point, const Eigen::Vector2d& slope,
                                         int axis) const;
  /// Radius of the spot that a point of height z lights with a source of this full angle (rad) as
  /// the lens sees it, pixels: to first order light from beside the axis lands distance × angle
  /// beside.
  [[nodiscard]] double source_radius(double angle, double z) const;

 private:
  LightPath light_;
  Eigen::Vector3d centre_;
  double growth_;
  double screen_;  ///< z, mm.
  double lens_area_;
  bool turned_;
  Eigen::Matrix3d turn_;  ///< From the lens frame to that of lamp and screen.
};

}  // namespace lensforge
