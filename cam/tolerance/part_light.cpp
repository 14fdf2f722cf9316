// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/part_light.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

namespace lensforge {
namespace {

Eigen::Matrix3d turn_of(const Eigen::Vector2d& tilt) {
  return (Eigen::AngleAxisd(tilt.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(tilt.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

/// The setup as the part sees it from its own frame. The screen's distance counts in land().
OpticalSetup seen_by_part(const OpticalSetup& setup, const PartError& error) {
  OpticalSetup seen = setup;
  // Parts are compared with each other: what their faces reflect differs by less than they do.
  seen.fresnel = false;
  seen.ior += error.index;
  if (!error.tilt.isZero()) {
    seen.light = (turn_of(error.tilt).transpose() * setup.light).normalized();
  }
  return seen;
}

}  // namespace

PartLight::PartLight(const OpticalSetup& setup, const PartError& error)
    : light_(seen_by_part(setup, error)),
      centre_(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), 0.0),
      growth_(1.0 + error.expansion),
      screen_(setup.focal_length + error.distance),
      lens_area_(setup.lens_size.prod() * growth_ * growth_),
      turned_(!error.tilt.isZero()),
      turn_(turn_of(error.tilt)) {}

Eigen::Vector2d PartLight::land(const Eigen::Vector3d& point, const Eigen::Vector2d& slope) const {
  const Eigen::Vector3d n = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  if (!light_.transmits(point, n)) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  const Eigen::Vector2d m = light_.beam(point, n).m;
  const ImagePlane& plane = light_.plane();
  if (!turned_) {
    return plane.to_pixels(Eigen::Vector2d(point.x(), point.y()) + (screen_ - point.z()) * m);
  }
  const Eigen::Vector3d from = centre_ + turn_ * (point - centre_);
  const Eigen::Vector3d way = turn_ * Eigen::Vector3d(m.x(), m.y(), 1.0);
  const double length = (screen_ - from.z()) / way.z();
  return plane.to_pixels(from.head<2>() + length * way.head<2>());
}

Eigen::Vector2d PartLight::moved_by(const Eigen::Vector3d& point, const Eigen::Vector2d& slope,
                                    int axis) const {
  constexpr double kStep = 1e-4;  // Third derivatives of refraction are of order 1: 1e-8 of it.
  const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
  return (land(point, slope + step) - land(point, slope - step)) / (2.0 * kStep);
}

double PartLight::source_radius(double angle, double z) const {
  const Eigen::Vector2d scale = light_.plane().pixels_per_mm().cwiseAbs();
  return std::sqrt(scale.prod()) * 0.5 * angle * (screen_ - z);
}

}  // namespace lensforge
