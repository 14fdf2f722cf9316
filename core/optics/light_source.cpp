// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/light_source.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <variant>

#include "core/optics/light_path.h"
#include "core/optics/refraction.h"

namespace lensforge {

LightSource::LightSource(const OpticalSetup& setup)
    : direction_(Eigen::Vector3d::UnitZ()),
      position_(Eigen::Vector3d::Zero()),
      axis_(Eigen::Vector3d::UnitZ()),
      eta_(setup.ior) {
  if (setup.front) front_ = FrontSurface(*setup.front);
  std::visit([&](const auto& lamp) { set(lamp, setup); }, setup.lamp);
}

void LightSource::set(const ParallelLight& lamp, const OpticalSetup& setup) {
  direction_ = lamp.direction;
  if (setup.front) {
    kind_ = Kind::kParallelBent;
  } else if (!traits(setup.body).transmits) {
    kind_ = Kind::kParallel;
  } else if (direction_ != Eigen::Vector3d::UnitZ()) {
    kind_ = Kind::kParallel;
    direction_ = refract(lamp.direction, Eigen::Vector3d::UnitZ(), 1.0 / setup.ior);
  }
}

void LightSource::set(const PointSource& lamp, const OpticalSetup& setup) {
  kind_ = setup.front                    ? Kind::kPointBent
          : traits(setup.body).transmits ? Kind::kPointBehindFront
                                         : Kind::kPoint;
  position_ = lamp.position;
  const Eigen::Vector3d middle(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), 0.0);
  const Eigen::Vector3d way = middle - position_;
  axis_ = way.normalized();
  // An evenly lit lens takes in its plan area; a solid angle is plan area × |way_z| / |way|³.
  scale_ = way.squaredNorm() * way.norm() / way.z();
  lambertian_ = lamp.emission == Emission::kLambertian ? 1.0 : 0.0;
}

Eigen::Vector3d LightSource::mean_direction(const Eigen::Vector2d& size) const {
  constexpr int kSamples = 64;  // Along an edge.
  // The mean derivative along a line follows from the line's ends.
  Eigen::Vector2d rise = Eigen::Vector2d::Zero();
  for (int k = 0; k < kSamples; ++k) {
    const Eigen::Vector2d along = (k + 0.5) / kSamples * size;
    rise += Eigen::Vector2d(front_.height({size.x(), along.y()}) - front_.height({0.0, along.y()}),
                            front_.height({along.x(), size.y()}) - front_.height({along.x(), 0.0}));
  }
  const Eigen::Vector2d gradient = rise.cwiseQuotient(kSamples * size);
  const Eigen::Vector3d n = Eigen::Vector3d(-gradient.x(), -gradient.y(), 1.0).normalized();
  const bool point = kind_ == Kind::kPointBent;
  const Eigen::Vector3d way =
      point ? Eigen::Vector3d((front_at(0.5 * size) - position_).normalized()) : direction_;
  return refract(way, n, 1.0 / eta_);
}

Eigen::Vector3d LightSource::entry(const Eigen::Vector3d& p) const {
  if (varies()) return position_ + vector_to(p);
  return p;
}

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

/// One point for every block of `side` by `side` pixels, at its centre of light, in pixels.
std::vector<SourcePoint> join_pixels(const SourceShape& shape, int side, double total) {
  const int across = (shape.columns + side - 1) / side;
  const int down = (shape.rows + side - 1) / side;
  const int count = across * down;
  std::vector<SourcePoint> blocks(static_cast<std::size_t>(count), {Eigen::Vector2d::Zero(), 0.0});
  const Eigen::Vector2d middle(0.5 * shape.columns, 0.5 * shape.rows);
  for (int r = 0; r < shape.rows; ++r) {
    for (int c = 0; c < shape.columns; ++c) {
      const int pixel = r * shape.columns + c;
      const int joined = r / side * across + c / side;
      const double share = shape.weights[static_cast<std::size_t>(pixel)] / total;
      SourcePoint& block = blocks[static_cast<std::size_t>(joined)];
      block.share += share;
      block.at += share * Eigen::Vector2d(c + 0.5 - middle.x(), middle.y() - r - 0.5);
    }
  }
  std::erase_if(blocks, [](const SourcePoint& block) { return block.share == 0.0; });
  for (SourcePoint& block : blocks) block.at /= block.share;
  return blocks;
}

/// The centres of `parts` by `parts` equal parts of every lit pixel, in pixels.
std::vector<SourcePoint> divide_pixels(const SourceShape& shape, int parts, double total) {
  const Eigen::Vector2d upper_left(-0.5 * shape.columns, 0.5 * shape.rows);
  std::vector<SourcePoint> points;
  for (int r = 0; r < shape.rows; ++r) {
    for (int c = 0; c < shape.columns; ++c) {
      const int pixel = r * shape.columns + c;
      const double weight = shape.weights[static_cast<std::size_t>(pixel)];
      if (weight > 0.0) divide_pixel({c, r}, parts, {upper_left, weight / total}, points);
    }
  }
  return points;
}

std::vector<SourcePoint> shape_points(const SourceExtent& extent, int count) {
  const SourceShape& shape = extent.shape;
  const auto lit = std::count_if(shape.weights.begin(), shape.weights.end(),
                                 [](double weight) { return weight > 0.0; });
  const double total = std::accumulate(shape.weights.begin(), shape.weights.end(), 0.0);
  const double each_way = std::sqrt(static_cast<double>(count) / static_cast<double>(lit));
  std::vector<SourcePoint> points =
      each_way >= 0.5 ? divide_pixels(shape, std::max(1, static_cast<int>(each_way)), total)
                      : join_pixels(shape, static_cast<int>(std::ceil(1.0 / each_way)), total);
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

/// @param middle  of the lens.
PointSource moved(const PointSource& lamp, const Eigen::Vector2d& at,
                  const Eigen::Vector2d& middle) {
  const Eigen::Vector3d to(middle.x(), middle.y(), 0.0);
  const SourceFrame frame = frame_across((to - lamp.position).normalized());
  return {lamp.position + (at.x() * frame.right + at.y() * frame.up), lamp.emission};
}

ParallelLight moved(const ParallelLight& lamp, const Eigen::Vector2d& at,
                    const Eigen::Vector2d& /*middle*/) {
  if (at.isZero()) return lamp;
  // The light travels opposite to the direction of the source.
  const SourceFrame frame = frame_across(lamp.direction);
  return {(lamp.direction - at.x() * frame.right - at.y() * frame.up).normalized()};
}

}  // namespace

std::vector<SourcePoint> source_points(const SourceExtent& extent, int count) {
  if (extent.none()) return {{Eigen::Vector2d::Zero(), 1.0}};
  if (extent.shape.is_disc()) return disc_points(extent.width, count);
  return shape_points(extent, count);
}

OpticalSetup lit_from(OpticalSetup setup, const Eigen::Vector2d& at) {
  setup.extent = {};
  setup.lamp = std::visit(
      [&](const auto& lamp) { return Lamp(moved(lamp, at, 0.5 * setup.lens_size)); }, setup.lamp);
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
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> squares;
  squares.computeDirect(sides.transpose() * sides, Eigen::EigenvaluesOnly);
  return std::sqrt(squares.eigenvalues()[1]);
}

}  // namespace lensforge
