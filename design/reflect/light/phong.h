// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <numbers>

#include "core/compute/host_device.h"

// Notation
//   n       unit normal of the surface
//   w_o     unit direction towards the sensor
//   w_i     unit direction towards the light
//   c       cosine between w_i and the mirror image of w_o
namespace lensforge::reflect {

/// The glossy black of the paper's printed shapes (Tojo et al., 3.1; the albedo is a choice).
inline constexpr double kAlbedo = 0.85;
inline constexpr double kDiffuse = 0.05;  ///< k_d
inline constexpr double kGlossy = 0.95;   ///< k_s
inline constexpr int kExponent = 30;      ///< n of Eq. 2
inline constexpr double kDiffuseFactor = kAlbedo * kDiffuse / std::numbers::pi;
inline constexpr double kGlossyFactor =
    kAlbedo * kGlossy * (kExponent + 2) / (2.0 * std::numbers::pi);

/// Below this cosine c the lobe is left out: 0.3^30 is 2e-16 of its top.
inline constexpr double kLobeEnd = 0.3;

/// c^29; times c it is the lobe.
LF_HD inline double lobe_slope_power(double c) {
  const double c2 = c * c;
  const double c4 = c2 * c2;
  const double c8 = c4 * c4;
  return c8 * c8 * c8 * c4 * c;
}

/// Light reflected towards w_o for unit irradiance across w_i: F = f(w_o, w_i)·max(0, n·w_i), with
/// the Phong BRDF f of Tojo et al., Eq. 2, times the albedo. 1/sr.
LF_HD inline double reflected(const Eigen::Vector3d& n, const Eigen::Vector3d& w_o,
                              const Eigen::Vector3d& w_i) {
  const double cos_i = n.dot(w_i);
  if (cos_i <= 0.0) return 0.0;
  const double c = 2.0 * n.dot(w_o) * cos_i - w_o.dot(w_i);
  if (c <= kLobeEnd) return kDiffuseFactor * cos_i;
  return (kDiffuseFactor + kGlossyFactor * lobe_slope_power(c) * c) * cos_i;
}

/// What reflected() is at most after the normal has turned by about a lobe's width: with a third of
/// the exponent, and the cosine larger by 0.2.
LF_HD inline double reflected_at_most(const Eigen::Vector3d& n, const Eigen::Vector3d& w_o,
                                      const Eigen::Vector3d& w_i) {
  const double cos_i = n.dot(w_i);
  const double c = 2.0 * n.dot(w_o) * cos_i - w_o.dot(w_i);
  if (c <= 0.0) return kDiffuseFactor * (cos_i + 0.2);
  const double c2 = c * c;
  return (kDiffuseFactor + kGlossyFactor * c2 * c2 * c2 * c2 * c2) * (cos_i + 0.2);
}

/// ∂F/∂n of reflected() for a free vector n:
/// f·w_i + cos_i·ρ k_s (n+2) n/(2π) c^(n−1)·2[(n·w_i) w_o + (n·w_o) w_i].
LF_HD inline Eigen::Vector3d reflected_adjoint(const Eigen::Vector3d& n, const Eigen::Vector3d& w_o,
                                               const Eigen::Vector3d& w_i) {
  const double cos_i = n.dot(w_i);
  if (cos_i <= 0.0) return Eigen::Vector3d::Zero();
  const double cos_o = n.dot(w_o);
  const double c = 2.0 * cos_o * cos_i - w_o.dot(w_i);
  if (c <= kLobeEnd) return kDiffuseFactor * w_i;
  const double power = lobe_slope_power(c);
  const double brdf = kDiffuseFactor + kGlossyFactor * power * c;
  const double slope = 2.0 * cos_i * kGlossyFactor * kExponent * power;
  return (brdf + slope * cos_o) * w_i + slope * cos_i * w_o;
}

}  // namespace lensforge::reflect
