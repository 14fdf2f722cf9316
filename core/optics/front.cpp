// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/front.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <utility>
#include <variant>

#include "core/compute/scalar.h"
#include "core/optics/light_path.h"
#include "core/optics/light_source.h"
#include "core/schema/description.h"

namespace lensforge {
namespace {

using Lines = Eigen::MatrixXd;  ///< n × L: one line per column.

/// m at all samples. "Not a knot" ends have m_0 = 2 m_1 − m_2; with m_0 + 4 m_1 + m_2 = 6 d_1, d
/// the second difference of the samples, this gives m_1 = d_1.
Lines second_derivatives(const Lines& samples) {
  const Eigen::Index n = samples.rows();
  Lines m(n, samples.cols());
  for (Eigen::Index i = 1; i < n - 1; ++i) {
    m.row(i) = samples.row(i - 1) - 2.0 * samples.row(i) + samples.row(i + 1);
  }
  // m_{i−1} + 4 m_i + m_{i+1} = 6 d_i for the others, by elimination from both known ends.
  Eigen::VectorXd pivot = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 2; i < n - 2; ++i) {
    pivot[i] = 1.0 / (4.0 - pivot[i - 1]);
    m.row(i) = pivot[i] * (6.0 * m.row(i) - m.row(i - 1));
  }
  for (Eigen::Index i = n - 3; i > 1; --i) m.row(i) -= pivot[i] * m.row(i + 1);
  m.row(0) = 2.0 * m.row(1) - m.row(2);
  m.row(n - 1) = 2.0 * m.row(n - 2) - m.row(n - 3);
  return m;
}

/// c of all lines; a sample is c_i + m_i / 6.
Lines coefficients_of(const Lines& samples) {
  constexpr Eigen::Index kBeyond = HeightSpline::kBeyond;
  const Eigen::Index n = samples.rows();
  const Lines m = second_derivatives(samples);
  Lines c(n + 2 * kBeyond, samples.cols());
  const auto at = [&c](Eigen::Index i) { return c.row(i + kBeyond); };
  c.middleRows(kBeyond, n) = samples - m / 6.0;
  at(-1) = m.row(0) + 2.0 * at(0) - at(1);
  at(n) = m.row(n - 1) + 2.0 * at(n - 1) - at(n - 2);
  at(-2) = 2.0 * at(-1) - at(0);
  at(n + 1) = 2.0 * at(n) - at(n - 1);
  return c;
}

}  // namespace

HeightSpline::HeightSpline(HeightGrid grid) : grid_(std::move(grid)) {
  Lines by_x(grid_.columns, grid_.rows);
  for (int row = 0; row < grid_.rows; ++row) {
    const float* const heights = grid_.heights.data() + std::ptrdiff_t{row} * grid_.columns;
    for (int i = 0; i < grid_.columns; ++i) {
      by_x(i, grid_.rows - 1 - row) = static_cast<double>(heights[i]);
    }
  }
  const Lines by_y = coefficients_of(by_x).transpose();
  const Lines all = coefficients_of(by_y).transpose();
  coefficients_.assign(all.data(), all.data() + all.size());
}

Eigen::MatrixXd HeightSpline::coefficient_matrix(int samples) {
  return coefficients_of(Lines::Identity(samples, samples));
}

float HeightSpline::lowest() const {
  return *std::min_element(grid_.heights.begin(), grid_.heights.end());
}

float HeightSpline::highest() const {
  return *std::max_element(grid_.heights.begin(), grid_.heights.end());
}

namespace {

/// Distance between samples, mm.
Eigen::Vector2d step_of(const HeightFront& front) {
  const HeightGrid& grid = front.spline->grid();
  return front.size.cwiseQuotient(Eigen::Vector2d(grid.columns - 1, grid.rows - 1));
}

void move(const Eigen::Vector2d& aside, SphericalFront& front) { front.apex.head<2>() += aside; }
void move(const Eigen::Vector2d& aside, HeightFront& front) { front.corner += aside; }

double lowest(const SphericalFront& front, const Eigen::AlignedBox2d& rectangle) {
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

double lowest(const HeightFront& front, const Eigen::AlignedBox2d& rectangle) {
  constexpr double kPlaces = 4.0;  // Per sample distance.
  const FrontSurface surface(front);
  const Eigen::Vector2d count =
      (kPlaces * rectangle.sizes().cwiseQuotient(step_of(front))).array().ceil();
  double least = kInfinity;
  for (int j = 0; j <= static_cast<int>(count.y()); ++j) {
    for (int i = 0; i <= static_cast<int>(count.x()); ++i) {
      const Eigen::Vector2d share = Eigen::Vector2d(i, j).cwiseQuotient(count);
      least =
          std::min(least, surface.height(rectangle.min() + share.cwiseProduct(rectangle.sizes())));
    }
  }
  return least;
}

}  // namespace

void describe(Description& d, SphericalFront& front) {
  d.number("radius", front.radius, {}, "mm", "above 0 convex").needed = true;
  d.numbers("apex", front.apex, "mm").needed = true;
}

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
  // Twice the diagonal back, parallel light is outside the part's plan or depth.
  const Eigen::Vector3d from = lamp_before(setup.lamp, e, 2.0 * setup.lens_size.norm());
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
    std::visit([&aside](auto& front) { move(aside, front); }, *moved.front);
    const LightPath path(moved);
    return path.plane().to_mm(path.land(p, path.beam(p, n).m));
  };
  const auto shift = [&](int axis) {
    const Eigen::Vector2d aside = kAside * Eigen::Vector2d::Unit(axis);
    return (lands(aside) - lands(-aside)).norm() / (2.0 * kAside);
  };
  return 0.5 * (shift(0) + shift(1));
}

double lowest_of(const Front& front, const Eigen::AlignedBox2d& rectangle) {
  return std::visit([&](const auto& one) { return lowest(one, rectangle); }, front);
}

std::optional<FrontFault> height_map_fault(const OpticalSetup& setup, double z) {
  const auto& map = std::get<HeightFront>(setup.front.value());
  const FrontSurface front(map);
  const FrontLight light = LightSource(setup).before_front();
  const HeightGrid& grid = map.spline->grid();
  const Eigen::Vector2d half = 0.5 * step_of(map);
  for (int j = 0; j < 2 * grid.rows - 1; ++j) {
    for (int i = 0; i < 2 * grid.columns - 1; ++i) {
      const FrontRefraction ray(front, light, half.cwiseProduct(Eigen::Vector2d(i, j)));
      if (!ray.lit || !(ray.b.z() > 0.0)) return FrontFault::kUnlit;
      if (!(ray.landing_by_x(z).determinant() > 0.0)) return FrontFault::kFolds;
    }
  }
  return std::nullopt;
}

}  // namespace lensforge
