// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/source_points.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>

#include "core/optics/light_path.h"

namespace lensforge {
namespace {

std::vector<SourcePoint> disc_points(double diameter, int count) {
  const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
  std::vector<SourcePoint> points;
  for (int i = 0; i < count; ++i) {
    const double radius = 0.5 * diameter * std::sqrt((i + 0.5) / count);
    points.push_back(
        {radius * Eigen::Vector2d(std::cos(i * golden_angle), std::sin(i * golden_angle)),
         1.0 / count});
  }
  return points;
}

/// Adds the centres of a pixel's parts, `parts` each way. @param corner  upper left, y down.
void divide_pixel(const Eigen::Vector2d& corner, int parts, const SourcePoint& whole,
                  std::vector<SourcePoint>& points) {
  for (int j = 0; j < parts; ++j) {
    for (int i = 0; i < parts; ++i) {
      const Eigen::Vector2d at = corner + Eigen::Vector2d(i + 0.5, j + 0.5) / parts;
      points.push_back(
          {whole.at + Eigen::Vector2d(at.x(), -at.y()), whole.share / (parts * parts)});
    }
  }
}

std::vector<SourcePoint> shape_points(const SourceExtent& extent, int count) {
  const SourceShape& shape = extent.shape;
  const auto lit = std::count_if(shape.weights.begin(), shape.weights.end(),
                                 [](double weight) { return weight > 0.0; });
  const double total = std::accumulate(shape.weights.begin(), shape.weights.end(), 0.0);
  const double per_pixel = static_cast<double>(count) / static_cast<double>(lit);
  const int parts = std::max(1, static_cast<int>(std::sqrt(per_pixel)));
  const Eigen::Vector2d upper_left(-0.5 * shape.columns, 0.5 * shape.rows);
  std::vector<SourcePoint> points;
  for (int r = 0; r < shape.rows; ++r) {
    for (int c = 0; c < shape.columns; ++c) {
      const double weight = shape.weights[static_cast<std::size_t>(r * shape.columns + c)];
      if (weight > 0.0) divide_pixel({c, r}, parts, {upper_left, weight / total}, points);
    }
  }
  for (SourcePoint& point : points) point.at *= extent.width / shape.columns;
  return points;
}

/// Right and up across the light, seen against it, with the lens's y up.
struct SourceFrame {
  Eigen::Vector3d right;
  Eigen::Vector3d up;
};

SourceFrame frame_across(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d up = (y - y.dot(direction) * direction).normalized();
  return {up.cross(direction), up};
}

}  // namespace

std::vector<SourcePoint> source_points(const SourceExtent& extent, int count) {
  if (extent.none()) return {{Eigen::Vector2d::Zero(), 1.0}};
  if (extent.shape.is_disc()) return disc_points(extent.width, count);
  return shape_points(extent, count);
}

OpticalSetup lit_from(OpticalSetup setup, const Eigen::Vector2d& at) {
  setup.extent = {};
  if (setup.point) {
    const Eigen::Vector3d middle(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), 0.0);
    const SourceFrame frame = frame_across((middle - setup.point->position).normalized());
    setup.point->position += at.x() * frame.right + at.y() * frame.up;
    return setup;
  }
  if (at.isZero()) return setup;
  // The light travels opposite to the direction of the source.
  const SourceFrame frame = frame_across(setup.light);
  setup.light = (setup.light - at.x() * frame.right - at.y() * frame.up).normalized();
  return setup;
}

Eigen::Matrix2d source_motion(const OpticalSetup& setup, double z) {
  const LightPath light(lit_from(setup, Eigen::Vector2d::Zero()));
  const Eigen::Vector3d p(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), z);
  const Eigen::Vector2d gradient = light.gradient_for(p, 0.5 * setup.pixels.cast<double>());
  const Eigen::Vector3d n = Eigen::Vector3d(-gradient.x(), -gradient.y(), 1.0).normalized();
  const double step = 0.5 * setup.extent.width;
  const auto landing = [&](const Eigen::Vector2d& at) -> Eigen::Vector2d {
    const LightPath moved(lit_from(setup, at));
    return moved.land(p, moved.beam(p, n).m);
  };
  Eigen::Matrix2d motion;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d along = step * Eigen::Vector2d::Unit(k);
    motion.col(k) = (landing(along) - landing(-along)) / (2.0 * step);
  }
  return motion;
}

double source_blur(const OpticalSetup& setup, double z) {
  if (setup.extent.none()) return 0.0;
  const SourceShape& shape = setup.extent.shape;
  const double height = shape.is_disc() ? 1.0 : static_cast<double>(shape.rows) / shape.columns;
  const Eigen::Matrix2d sides =
      setup.extent.width * source_motion(setup, z) * Eigen::Vector2d(1.0, height).asDiagonal();
  return Eigen::JacobiSVD<Eigen::Matrix2d>(sides).singularValues()[0];
}

}  // namespace lensforge
