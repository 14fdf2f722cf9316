// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace lensforge::testing {

/// Random numbers of a fixed seed.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  [[nodiscard]] double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  [[nodiscard]] int below(int count) {
    return std::uniform_int_distribution<int>(0, count - 1)(engine_);
  }
  /// Log-uniform.
  [[nodiscard]] double magnitude(double low, double high) {
    return std::exp(between(std::log(low), std::log(high)));
  }
  /// Every coordinate in −1 … 1.
  [[nodiscard]] Eigen::Vector2d vector2() { return {between(-1.0, 1.0), between(-1.0, 1.0)}; }
  [[nodiscard]] Eigen::Vector3d vector3() {
    return {between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)};
  }
  /// A unit vector up to `tilt` radians away from +z.
  [[nodiscard]] Eigen::Vector3d near_z(double tilt) {
    const double theta = between(0.0, tilt);
    const double phi = between(0.0, 2.0 * std::numbers::pi);
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
  }
  [[nodiscard]] std::mt19937_64& engine() { return engine_; }

 private:
  std::mt19937_64 engine_;
};

}  // namespace lensforge::testing
