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
template <class T>
LF_HD inline T lobe_slope_power(T c) {
  const T c2 = c * c;
  const T c4 = c2 * c2;
  const T c8 = c4 * c4;
  return c8 * c8 * c8 * c4 * c;
}

/// Reflected light with its derivative along_i·w_i + along_o·w_o by a free vector n.
template <class T>
struct PhongTerms {
  T value;
  T along_i;
  T along_o;
};

/// Light reflected towards w_o for unit irradiance across w_i: F = f(w_o, w_i)·max(0, n·w_i), with
/// the Phong BRDF f of Tojo et al., Eq. 2, times the albedo, 1/sr; and
/// ∂F/∂n = f·w_i + cos_i·ρ k_s (n+2) n/(2π) c^(n−1)·2[(n·w_i) w_o + (n·w_o) w_i].
/// Without branches, so that loops over directions use the processor's vector units.
/// @param c  2 (n·w_o)(n·w_i) − w_o·w_i.
template <class T>
LF_HD inline PhongTerms<T> phong_terms(T c, T cos_o, T cos_i) {
  const T lobe = c > T(kLobeEnd) ? c : T(0);
  const T power = lobe_slope_power(lobe);
  const T facing = cos_i > T(0) ? T(1) : T(0);
  const T brdf = facing * (T(kDiffuseFactor) + T(kGlossyFactor) * power * lobe);
  const T slope = facing * (T(2 * kExponent * kGlossyFactor) * power * cos_i);
  return {brdf * cos_i, brdf + slope * cos_o, slope * cos_i};
}

LF_HD inline PhongTerms<double> phong_terms(const Eigen::Vector3d& n, const Eigen::Vector3d& w_o,
                                            const Eigen::Vector3d& w_i) {
  const double cos_o = n.dot(w_o);
  const double cos_i = n.dot(w_i);
  return phong_terms(2.0 * cos_o * cos_i - w_o.dot(w_i), cos_o, cos_i);
}

/// F of phong_terms().
LF_HD inline double reflected(const Eigen::Vector3d& n, const Eigen::Vector3d& w_o,
                              const Eigen::Vector3d& w_i) {
  return phong_terms(n, w_o, w_i).value;
}

/// ∂F/∂n of phong_terms().
LF_HD inline Eigen::Vector3d reflected_adjoint(const Eigen::Vector3d& n, const Eigen::Vector3d& w_o,
                                               const Eigen::Vector3d& w_i) {
  const PhongTerms<double> terms = phong_terms(n, w_o, w_i);
  return terms.along_i * w_i + terms.along_o * w_o;
}

/// What F is at most after the normal has turned by about a lobe's width: with a third of the
/// exponent, and the cosine larger by 0.2. @param c  cosine between w_i and w_o's mirror image.
template <class T>
LF_HD inline T reflected_at_most(T c, T cos_i) {
  const T lobe = c > T(0) ? c : T(0);
  const T c2 = lobe * lobe;
  return (T(kDiffuseFactor) + T(kGlossyFactor) * c2 * c2 * c2 * c2 * c2) * (cos_i + T(0.2));
}

}  // namespace lensforge::reflect
