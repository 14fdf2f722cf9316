// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/part_light.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/optics/source_points.h"

namespace lensforge {
namespace {

Eigen::Matrix3d turn_of(const Eigen::Vector2d& tilt) {
  return (Eigen::AngleAxisd(tilt.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(tilt.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Vector3d centre_of(const OpticalSetup& setup) {
  return {0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), 0.0};
}

/// Lamp and screen as a part sees them that was turned about its centre: turned the other way.
void turn_back(OpticalSetup& seen, const Eigen::Matrix3d& turn) {
  const Eigen::Matrix3d back = turn.transpose();
  const Eigen::Vector3d centre = centre_of(seen);
  const Eigen::Vector3d screen = centre + back * (seen.screen_centre() - centre);
  seen.light = (back * seen.light).normalized();
  if (seen.point) seen.point->position = centre + back * (seen.point->position - centre);
  seen.screen_x = back * seen.screen_x;
  seen.screen_y = back * seen.screen_y;
  seen.image_origin = screen.head<2>() - 0.5 * seen.image_size;
  seen.focal_length = screen.z();
}

/// The setup as the part sees it from its own frame.
OpticalSetup seen_by_part(const OpticalSetup& setup, const PartError& error) {
  OpticalSetup seen = setup;
  // Parts are compared with each other: what their faces reflect differs by less than they do.
  seen.fresnel = false;
  seen.ior += error.index;
  const Eigen::Vector3d away = error.distance * setup.screen_x.cross(setup.screen_y);
  seen.image_origin += away.head<2>();
  seen.focal_length += away.z();
  if (!error.tilt.isZero()) turn_back(seen, turn_of(error.tilt));
  return seen;
}

/// Parallel light straight through a lens onto a screen that is parallel to it.
bool is_straight(const OpticalSetup& setup) {
  return setup.mode == LightMode::kRefract && !setup.point && !setup.screen_is_turned() &&
         setup.light == Eigen::Vector3d::UnitZ();
}

}  // namespace

PartLight::PartLight(const OpticalSetup& setup, const PartError& error)
    : seen_(seen_by_part(setup, error)),
      light_(seen_),
      centre_(centre_of(setup)),
      growth_(1.0 + error.expansion),
      straight_(is_straight(setup)),
      screen_(setup.focal_length + error.distance) {}

Eigen::Vector2d PartLight::land(const Eigen::Vector3d& point, const Eigen::Vector2d& slope) const {
  const Eigen::Vector3d n = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  if (!light_.transmits(point, n)) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return light_.land(point, light_.beam(point, n).m);
}

double PartLight::whole(const PartNodes& nodes) const {
  if (straight_) return seen_.lens_size.prod() * growth_ * growth_;
  const auto place = [&](std::size_t n) {
    return grown(nodes.places[n].head<2>(), nodes.places[n].z());
  };
  double sum = 0.0;
  for (std::size_t a = 0; a + nodes.columns + 1 < nodes.places.size(); ++a) {
    if ((a + 1) % nodes.columns == 0) continue;
    const std::size_t c = a + nodes.columns + 1;
    sum += intake({place(a), place(a + 1), place(c)});
    sum += intake({place(a), place(c), place(c - 1)});
  }
  return sum;
}

Eigen::Vector2d PartLight::slope_of_middle(double z) const {
  if (straight_) return {0.0, 0.0};
  return light_.gradient_for(grown(centre_.head<2>(), z), 0.5 * seen_.pixels.cast<double>());
}

Eigen::Vector2d PartLight::moved_by(const Eigen::Vector3d& point, const Eigen::Vector2d& slope,
                                    int axis) const {
  constexpr double kStep = 1e-4;  // Third derivatives of refraction are of order 1: 1e-8 of it.
  const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
  return (land(point, slope + step) - land(point, slope - step)) / (2.0 * kStep);
}

Eigen::Vector2d PartLight::source_radii(double angle, double z) const {
  if (angle == 0.0) return {0.0, 0.0};
  if (straight_) {
    const Eigen::Vector2d scale = light_.plane().pixels_per_mm().cwiseAbs();
    return Eigen::Vector2d::Constant(std::sqrt(scale.prod()) * 0.5 * angle * (screen_ - z));
  }
  OpticalSetup source = seen_;
  source.extent.shape = {};
  source.extent.width = angle * (source.point ? (source.point->position - centre_).norm() : 1.0);
  return 0.5 * source.extent.width * source_motion(source, z).rowwise().norm();
}

}  // namespace lensforge
