// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>

#include "core/lens/surface_field.h"

namespace lensforge::testing {

/// Height, slope and smooth piece of a surface at one place.
struct SurfacePoint {
  double z = 0.0;
  Eigen::Vector2d slope{0.0, 0.0};
  std::int32_t cut = 0;
};

/// A field from a formula.
class AnalyticField : public SurfaceField {
 public:
  using Formula = std::function<SurfacePoint(const Eigen::Vector2d&)>;
  explicit AnalyticField(Formula formula, bool has_cuts = true)
      : formula_(std::move(formula)), has_cuts_(has_cuts) {}

  [[nodiscard]] SurfacePoint at(const Eigen::Vector2d& p) const { return formula_(p); }

  void sample(const GridWindow& window, const Executor& /*executor*/,
              SurfacePatch& patch) const override {
    patch = {};
    patch.window = window;
    for (std::int64_t j = 0; j < window.rows; ++j) {
      for (std::int64_t i = 0; i < window.columns; ++i) {
        const SurfacePoint point = formula_(window.node(i, j));
        patch.z.push_back(point.z);
        patch.slope_x.push_back(point.slope.x());
        patch.slope_y.push_back(point.slope.y());
        if (has_cuts_) patch.cut.push_back(point.cut);
      }
    }
  }

 private:
  Formula formula_;
  bool has_cuts_;
};

/// z = 5 + slope · p.
inline AnalyticField::Formula plane(const Eigen::Vector2d& slope) {
  return [slope](const Eigen::Vector2d& p) { return SurfacePoint{5.0 + slope.dot(p), slope, 0}; };
}

/// The plane z = 5 after a ball of radius R was moved along y in rows `pitch` apart.
inline AnalyticField::Formula scalloped_plane(double radius, double pitch) {
  return [=](const Eigen::Vector2d& p) {
    const double row = std::round(p.x() / pitch);
    const double x = p.x() - row * pitch;
    const double root = std::sqrt(radius * radius - x * x);
    return SurfacePoint{5.0 + radius - root, {x / root, 0.0}, static_cast<std::int32_t>(row)};
  };
}

/// Two planes that meet in a ridge over x = `ridge`; the slopes are +slope and −slope.
inline AnalyticField::Formula roof(double ridge, double slope) {
  return [=](const Eigen::Vector2d& p) {
    const double side = p.x() < ridge ? 1.0 : -1.0;
    return SurfacePoint{
        5.0 - slope * std::abs(p.x() - ridge), {side * slope, 0.0}, side > 0 ? 1 : 2};
  };
}

/// A V-groove over x = `groove` whose floor a ball of radius R has rounded: two planes and the
/// fillet that touches both, each a piece of its own.
inline AnalyticField::Formula rounded_groove(double groove, double slope, double radius) {
  return [=](const Eigen::Vector2d& p) {
    const double x = p.x() - groove;
    const double half = radius * slope / std::sqrt(1.0 + slope * slope);
    if (std::abs(x) >= half) {
      const double side = x < 0.0 ? -1.0 : 1.0;
      return SurfacePoint{5.0 + slope * std::abs(x), {side * slope, 0.0}, x < 0.0 ? 1 : 2};
    }
    const double root = std::sqrt(radius * radius - x * x);
    const double centre = 5.0 + radius * std::sqrt(1.0 + slope * slope);
    return SurfacePoint{centre - root, {x / root, 0.0}, 3};
  };
}

}  // namespace lensforge::testing
