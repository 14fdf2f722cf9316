// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <variant>

#include "core/optics/height_fronts.h"
#include "core/optics/optical_setup.h"
#include "design/snell.h"

/// Setups with every kind of light, and single rays of theirs worked out apart from LightPath.
namespace lensforge::testing {

inline const Eigen::Vector3d kPlace(40.0, 30.0, 5.0);

inline OpticalSetup shifted_setup() {
  OpticalSetup setup;
  setup.lens_size = {100.0, 80.0};
  setup.pixels = {50, 20};
  setup.image_size = {200.0, 60.0};
  setup.image_origin = {-30.0, 12.0};
  return setup;
}

inline OpticalSetup oblique_setup() {
  OpticalSetup setup = shifted_setup();
  setup.lamp = ParallelLight{Eigen::Vector3d(0.3, -0.2, 1.0).normalized()};
  return setup;
}

inline OpticalSetup turned_setup() {
  OpticalSetup setup = shifted_setup();
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()) *
                                Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
  setup.screen_x = turn.col(0);
  setup.screen_y = turn.col(1);
  return setup;
}

inline OpticalSetup point_setup(Emission emission) {
  OpticalSetup setup = turned_setup();
  setup.lamp = PointSource{{70.0, 20.0, -120.0}, emission};
  return setup;
}

inline OpticalSetup mirror_setup() {
  OpticalSetup setup = turned_setup();
  setup.body = MirrorBody{};
  setup.lamp = ParallelLight{Eigen::Vector3d(0.5, 0.1, -1.0).normalized()};
  return setup;
}

inline OpticalSetup lit_mirror_setup() {
  OpticalSetup setup = mirror_setup();
  setup.lamp = PointSource{{-60.0, 30.0, 150.0}, Emission::kLambertian};
  return setup;
}

inline OpticalSetup front_setup(double radius) {
  OpticalSetup setup = oblique_setup();
  setup.front = SphericalFront{radius, {55.0, 38.0, radius > 0.0 ? -20.0 : 0.0}};
  return setup;
}

inline OpticalSetup point_front_setup(double radius, Emission emission) {
  OpticalSetup setup = point_setup(emission);
  setup.front = front_setup(radius).front;
  return setup;
}

/// A polynomial of third order, which a map of it is but for rounding: its samples have few bits.
inline double cubic_height(const Eigen::Vector2d& xy) {
  const double x = xy.x() - 50.0;
  const double y = xy.y() - 40.0;
  return x * x / 256.0 + y * y / 512.0 + x * y / 2048.0 + x * x * x / 131072.0 - 14.0;
}
inline Eigen::Vector3d cubic_normal(const Eigen::Vector2d& xy) {
  const double x = xy.x() - 50.0;
  const double y = xy.y() - 40.0;
  return Eigen::Vector3d(-(x / 128.0 + y / 2048.0 + 3.0 * x * x / 131072.0),
                         -(y / 256.0 + x / 2048.0), 1.0)
      .normalized();
}

inline OpticalSetup map_setup() {
  OpticalSetup setup = oblique_setup();
  setup.front = height_front(setup.lens_size, {5, 5}, cubic_height);
  return setup;
}

inline OpticalSetup point_map_setup(Emission emission) {
  OpticalSetup setup = point_setup(emission);
  setup.front = map_setup().front;
  return setup;
}

inline OpticalSetup losing(OpticalSetup setup) {
  setup.fresnel = true;
  return setup;
}

struct KindOfLight {
  const char* name;
  OpticalSetup setup;
};

/// Normal of a front at a place, towards the inside, and its point there: of a sphere on the line
/// to its centre, of a height map those of the polynomial.
inline Eigen::Vector3d front_normal(const Front& any, const Eigen::Vector3d& e) {
  if (std::holds_alternative<HeightFront>(any)) return cubic_normal(e.head<2>());
  const auto& front = std::get<SphericalFront>(any);
  const Eigen::Vector3d centre = front.apex + front.radius * Eigen::Vector3d::UnitZ();
  return (centre - e).normalized() * (front.radius > 0.0 ? 1.0 : -1.0);
}
inline Eigen::Vector3d front_point(const Front& any, const Eigen::Vector2d& xy) {
  if (std::holds_alternative<HeightFront>(any)) return {xy.x(), xy.y(), cubic_height(xy)};
  const auto& front = std::get<SphericalFront>(any);
  const double across = (xy - front.apex.head<2>()).norm();
  const double depth = std::abs(front.radius) * std::cos(std::asin(across / front.radius));
  return {xy.x(), xy.y(), front.apex.z() + front.radius - (front.radius > 0.0 ? depth : -depth)};
}

/// Unit direction of the light before a lens at a point.
inline Eigen::Vector3d way_to(const OpticalSetup& setup, const Eigen::Vector3d& p) {
  if (const auto* const lamp = std::get_if<ParallelLight>(&setup.lamp)) return lamp->direction;
  return (p - std::get<PointSource>(setup.lamp).position).normalized();
}

/// The ray that comes to a point through a curved front: its place on the front is moved by what
/// the ray misses the point by, until it meets it.
struct FrontRay {
  Eigen::Vector3d place;
  Eigen::Vector3d inside;
};
inline FrontRay reference_front_ray(const OpticalSetup& setup, const Eigen::Vector3d& p) {
  Eigen::Vector2d xy = p.head<2>();
  FrontRay ray;
  for (int k = 0; k < 100; ++k) {
    ray.place = front_point(*setup.front, xy);
    const Eigen::Vector3d way = way_to(setup, ray.place);
    ray.inside = refract_by_angles(way, front_normal(*setup.front, ray.place), 1.0 / setup.ior);
    const Eigen::Vector2d m = ray.inside.head<2>() / ray.inside.z();
    xy -= xy + (p.z() - ray.place.z()) * m - p.head<2>();
  }
  return ray;
}

/// Direction of the light inside the lens at a point, or at a mirror, worked out with angles.
inline Eigen::Vector3d reference_incident(const OpticalSetup& setup, const Eigen::Vector3d& p) {
  if (setup.front) return reference_front_ray(setup, p).inside;
  const auto inside = [&](const Eigen::Vector3d& way) {
    return refract_by_angles(way.normalized(), Eigen::Vector3d::UnitZ(), 1.0 / setup.ior);
  };
  const auto place = lamp_place(setup.lamp);
  Eigen::Vector3d straight = way_to(setup, p);
  if (!traits(setup.body).transmits) return straight;
  if (!place) return inside(straight);
  const Eigen::Vector3d& from = *place;
  // The place on the front from which a ray goes to p, by bisection of its distance from the
  // source.
  const Eigen::Vector2d across = (p - from).head<2>();
  double low = 0.0;
  double high = 1.0;
  for (int k = 0; k < 60; ++k) {
    const double share = 0.5 * (low + high);
    const Eigen::Vector3d b = inside({share * across.x(), share * across.y(), -from.z()});
    const double reached = share * across.norm() + p.z() * b.head<2>().norm() / b.z();
    (reached < across.norm() ? low : high) = share;
  }
  return inside({low * across.x(), low * across.y(), -from.z()});
}

}  // namespace lensforge::testing
