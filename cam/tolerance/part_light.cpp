// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/part_light.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <variant>

#include "core/optics/light_source.h"

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

}  // namespace

/// They are turned the other way.
OpticalSetup seen_by_turned_part(OpticalSetup seen, const Eigen::Vector2d& tilt) {
  const Eigen::Matrix3d back = turn_of(tilt).transpose();
  const Eigen::Vector3d centre = centre_of(seen);
  const Eigen::Vector3d screen = centre + back * (seen.screen_centre() - centre);
  seen.lamp =
      std::visit([&](const auto& lamp) { return Lamp(lamp.turned(back, centre)); }, seen.lamp);
  seen.screen_x = back * seen.screen_x;
  seen.screen_y = back * seen.screen_y;
  seen.image_origin = screen.head<2>() - 0.5 * seen.image_size;
  seen.focal_length = screen.z();
  return seen;
}

namespace {

/// The setup in the part's own frame.
OpticalSetup seen_by_part(const OpticalSetup& setup, const PartError& error) {
  OpticalSetup seen = setup;
  // Parts are only compared with each other: the reflection at their faces differs less than they
  // do.
  seen.fresnel = false;
  seen.ior += error.index;
  const Eigen::Vector3d away = error.distance * setup.screen_x.cross(setup.screen_y);
  seen.image_origin += away.head<2>();
  seen.focal_length += away.z();
  return error.tilt.isZero() ? seen : seen_by_turned_part(seen, error.tilt);
}

/// True for parallel light along a lens's axis, through a flat front, onto a screen parallel to it.
bool is_straight(const OpticalSetup& setup) {
  return traits(setup.body).transmits && setup.lamp == Lamp() && !setup.front &&
         !setup.screen_is_turned();
}

}  // namespace

PartLight::PartLight(const OpticalSetup& setup, const PartError& error)
    : seen_(seen_by_part(setup, error)),
      light_(seen_),
      centre_(centre_of(setup)),
      growth_(1.0 + error.expansion),
      straight_(is_straight(setup)),
      screen_(setup.focal_length + error.distance) {}

Eigen::Vector2d PartLight::land(const Eigen::Vector3d& point, const Eigen::Vector2d& slope,
                                const IncidentRay* known) const {
  const Eigen::Vector3d n = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  if (!light_.transmits(point, n, known)) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return light_.land(point, light_.beam(point, n, known).m);
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
  const auto place = lamp_place(source.lamp);
  source.extent.width = angle * (place ? (*place - centre_).norm() : 1.0);
  return 0.5 * source.extent.width * source_motion(source, z).rowwise().norm();
}

namespace {

/// Rings of equal area per pixel of radius, and places per pixel of their length: finer ones change
/// no share by more than 0.001.
constexpr double kRings = 6.0;
constexpr double kPlaces = 8.0;

/// Bisections for the radius: to 1e-9 of it.
constexpr int kBisections = 30;

/// Splits every place of a disc between the four pixels around it.
BlurKernel split_disc(const Eigen::Vector2d& radii, std::int64_t reach) {
  BlurKernel kernel{reach, {}};
  const std::int64_t side = 2 * reach + 1;
  kernel.share.assign(static_cast<std::size_t>(side * side), 0.0);
  const double radius = radii.maxCoeff();
  const auto rings = static_cast<int>(std::ceil(kRings * std::max(1.0, radius)));
  const auto places = 4 * static_cast<int>(std::ceil(kPlaces * std::max(1.0, radius)));
  const double weight = 1.0 / (rings * places);
  for (int ring = 0; ring < rings; ++ring) {
    const Eigen::Vector2d out = radii * std::sqrt((ring + 0.5) / rings);
    for (int k = 0; k < places; ++k) {
      const double angle = 2.0 * std::numbers::pi * (k + 0.5) / places;
      const double x = out.x() * std::cos(angle) + static_cast<double>(reach);
      const double y = out.y() * std::sin(angle) + static_cast<double>(reach);
      const double u = x - std::floor(x);
      const double v = y - std::floor(y);
      const auto at = static_cast<std::size_t>(static_cast<std::int64_t>(y) * side +
                                               static_cast<std::int64_t>(x));
      kernel.share[at] += weight * (1.0 - u) * (1.0 - v);
      kernel.share[at + 1] += weight * u * (1.0 - v);
      kernel.share[at + static_cast<std::size_t>(side)] += weight * (1.0 - u) * v;
      kernel.share[at + static_cast<std::size_t>(side) + 1] += weight * u * v;
    }
  }
  return kernel;
}

double variance(const BlurKernel& kernel, int axis) {
  const std::int64_t side = 2 * kernel.reach + 1;
  double sum = 0.0;
  for (std::int64_t n = 0; n < side * side; ++n) {
    const auto place = static_cast<double>((axis == 0 ? n % side : n / side) - kernel.reach);
    sum += kernel.share[static_cast<std::size_t>(n)] * place * place;
  }
  return sum;
}

}  // namespace

/// The variance along an axis depends on the half axis along it alone.
BlurKernel disc_blur(const Eigen::Vector2d& radii) {
  if (radii.isZero()) return {};
  const auto reach = static_cast<std::int64_t>(std::ceil(radii.maxCoeff())) + 1;
  Eigen::Vector2d low(0.0, 0.0);
  Eigen::Vector2d high = radii;
  for (int step = 0; step < kBisections; ++step) {
    const Eigen::Vector2d middle = 0.5 * (low + high);
    const BlurKernel kernel = split_disc(middle, reach);
    for (int axis = 0; axis < 2; ++axis) {
      const bool narrow = variance(kernel, axis) < 0.25 * radii[axis] * radii[axis];
      (narrow ? low : high)[axis] = middle[axis];
    }
  }
  return split_disc(0.5 * (low + high), reach);
}

FluxRaster blurred(const FluxRaster& raster, const BlurKernel& kernel, const Executor& executor) {
  FluxRaster result{raster.columns, raster.rows, std::vector<double>(raster.flux.size(), 0.0)};
  const std::int64_t side = 2 * kernel.reach + 1;
  const auto blur_row = [&](std::int64_t row) {
    double* const out = &result.flux[static_cast<std::size_t>(row * raster.columns)];
    for (std::int64_t b = -kernel.reach; b <= kernel.reach; ++b) {
      const std::int64_t from = row - b;
      if (from < 0 || from >= raster.rows) continue;
      const double* const in = &raster.flux[static_cast<std::size_t>(from * raster.columns)];
      const double* const share =
          &kernel.share[static_cast<std::size_t>((b + kernel.reach) * side)];
      for (std::int64_t a = -kernel.reach; a <= kernel.reach; ++a) {
        const std::int64_t low = std::max<std::int64_t>(0, a);
        const std::int64_t high = std::min(raster.columns, raster.columns + a);
        for (std::int64_t i = low; i < high; ++i) out[i] += share[a + kernel.reach] * in[i - a];
      }
    }
  };
  parallel_for(executor, "blur by the source", raster.rows, blur_row, 4);
  return result;
}

}  // namespace lensforge
