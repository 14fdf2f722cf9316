// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/front_placement.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "core/optics/light_source.h"

namespace lensforge {

SphericalFront spherical_front(double radius, const Eigen::Vector2d& lens_size) {
  const Eigen::Vector2d middle = 0.5 * lens_size;
  SphericalFront front{radius, {middle.x(), middle.y(), 0.0}};
  front.apex.z() = 0.0 - std::max(0.0, FrontSurface(front).height({0.0, 0.0}));
  return front;
}

bool is_shadowed(const OpticalSetup& setup, const Eigen::Vector2d& place) {
  constexpr int kSamples = 100;
  if (!setup.front) return false;
  const FrontSurface front(*setup.front);
  const Eigen::AlignedBox2d plan(Eigen::Vector2d(0.0, 0.0), setup.lens_size);
  const Eigen::Vector3d e(place.x(), place.y(), front.height(place));
  // Parallel light as far back as the lens is wide has left the part's plan or its depth.
  const Eigen::Vector3d from =
      setup.point ? setup.point->position
                  : Eigen::Vector3d(e - 2.0 * setup.lens_size.norm() * setup.light);
  for (int k = 0; k < kSamples; ++k) {
    const Eigen::Vector3d p = from + (k / double{kSamples}) * (e - from);
    if (plan.contains(p.head<2>()) && p.z() > front.height(p.head<2>())) return true;
  }
  return false;
}

double overhang(const OpticalSetup& setup, const Eigen::Vector3d& p) {
  const Eigen::Vector3d e = LightSource(setup).entry(p);
  const Eigen::Vector2d beyond =
      (-e.head<2>()).cwiseMax(Eigen::Vector2d(e.head<2>() - setup.lens_size));
  return std::max(0.0, beyond.maxCoeff());
}

}  // namespace lensforge
