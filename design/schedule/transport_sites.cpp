// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/transport_sites.h"

#include <Eigen/LU>
#include <cmath>

#include "core/optics/light_path.h"

namespace lensforge {
namespace {

/// Steps of the differences, mm and slope: third derivatives are of order 1 over the distance of
/// the screen, which leaves 1e-8 of them.
constexpr double kStep = 1e-4;

/// Below it M differs from the identity by the differences' own errors.
constexpr double kEven = 1e-6;

/// The symmetric part of M at the middle of the start surface.
Eigen::Matrix2d motion_of(const OpticalSetup& setup) {
  const LightPath light(setup);
  const Eigen::Vector3d p(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), 0.0);
  const Eigen::Vector2d flat = light.gradient_for(p, light.land_from_start(p));
  const auto land = [&](const Eigen::Vector2d& slope) {
    const Eigen::Vector3d n = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
    return light.land(p, light.beam(p, n).m);
  };
  Eigen::Matrix2d by_slope;
  Eigen::Matrix2d by_place;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(k);
    by_slope.col(k) = (land(flat + step) - land(flat - step)) / (2.0 * kStep);
    const Eigen::Vector3d aside(step.x(), step.y(), 0.0);
    by_place.col(k) =
        (light.land_from_start(p + aside) - light.land_from_start(p - aside)) / (2.0 * kStep);
  }
  const Eigen::Matrix2d motion = by_slope * by_place.transpose();
  return 0.5 * (motion + motion.transpose());
}

}  // namespace

TransportSites::TransportSites(const OpticalSetup& setup)
    : centre_(0.5 * setup.pixels.cast<double>()) {
  const Eigen::Matrix2d motion = motion_of(setup);
  const double determinant = motion.determinant();
  // Where both signs occur no potential is convex; then light is moved least.
  if (!(determinant > 0.0)) return;
  // Light that moves against its slope has the concave potential.
  const double sign = motion(0, 0) < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix2d even = sign / std::sqrt(determinant) * motion;
  if (even.isApprox(motion_, kEven)) return;
  motion_ = even;
  inverse_ = motion_.inverse();
}

}  // namespace lensforge
