// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/front_placement.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "core/optics/light_path.h"

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

double shift_by_front(const OpticalSetup& setup, const Eigen::Vector3d& p) {
  constexpr double kAside = 1e-3;  // mm
  const LightPath light(setup);
  const Eigen::Vector2d slope = light.gradient_for(p, light.land_from_start(p));
  const Eigen::Vector3d n = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  const auto lands = [&](const Eigen::Vector2d& aside) -> Eigen::Vector2d {
    OpticalSetup moved = setup;
    moved.front->apex.head<2>() += aside;
    const LightPath path(moved);
    return path.plane().to_mm(path.land(p, path.beam(p, n).m));
  };
  const auto shift = [&](int axis) {
    const Eigen::Vector2d aside = kAside * Eigen::Vector2d::Unit(axis);
    return (lands(aside) - lands(-aside)).norm() / (2.0 * kAside);
  };
  return 0.5 * (shift(0) + shift(1));
}

double lowest_of(const SphericalFront& front, const Eigen::AlignedBox2d& rectangle) {
  const FrontSurface surface(front);
  const Eigen::Vector2d apex = front.apex.head<2>();
  if (front.radius > 0.0) {
    return surface.height(apex.cwiseMax(rectangle.min()).cwiseMin(rectangle.max()));
  }
  const Eigen::Vector2d middle = rectangle.center();
  const Eigen::Vector2d far =
      (apex.array() < middle.array()).select(rectangle.max(), rectangle.min());
  return surface.height(far);
}

}  // namespace lensforge
