// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <numbers>

#include "core/compute/host_device.h"

// Light that a face reflects (Phong), its loss, and both for all directions at once.

namespace lensforge::reflect {

/// ε of the loss 1/(L + ε).
inline constexpr double kLossFloor = 1e-5;

/// Function of a radiance L that is minimised.
enum class Loss {
  kSquare,          ///< L²
  kNegativeSquare,  ///< −L², for a large L.
  kInverse,         ///< 1/(L + ε), for a large L (Tojo et al., 4.1).
};

[[nodiscard]] LF_HD inline double loss_of(Loss loss, double radiance) {
  if (loss == Loss::kInverse) return 1.0 / (radiance + kLossFloor);
  return loss == Loss::kSquare ? radiance * radiance : -radiance * radiance;
}

/// Derivative of loss_of().
[[nodiscard]] LF_HD inline double loss_slope(Loss loss, double radiance) {
  if (loss != Loss::kInverse) return loss == Loss::kSquare ? 2.0 * radiance : -2.0 * radiance;
  const double inverse = 1.0 / (radiance + kLossFloor);
  return -inverse * inverse;
}

/// Size of the second derivative of loss_of().
[[nodiscard]] LF_HD inline double loss_curvature(Loss loss, double radiance) {
  if (loss != Loss::kInverse) return 2.0;
  const double inverse = 1.0 / (radiance + kLossFloor);
  return 2.0 * inverse * inverse * inverse;
}

// Notation
//   n       unit normal of the surface
//   w_o     unit direction towards the sensor
//   w_i     unit direction towards the light
//   c       cosine between w_i and the mirror image of w_o

/// The glossy black of the paper's printed shapes (Tojo et al., 3.1; the albedo is a choice).
inline constexpr double kAlbedo = 0.85;
inline constexpr double kDiffuse = 0.05;  ///< k_d
inline constexpr double kGlossy = 0.95;   ///< k_s
inline constexpr int kExponent = 30;      ///< n of Eq. 2
inline constexpr double kDiffuseFactor = kAlbedo * kDiffuse / std::numbers::pi;
inline constexpr double kGlossyFactor =
    kAlbedo * kGlossy * (kExponent + 2) / (2.0 * std::numbers::pi);

/// Below this cosine c the lobe is left out: 0.3^30 is 2e-16 of its maximum.
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

/// Upper bound of F after the normal has turned by about a lobe's width: a third of the exponent,
/// and the cosine larger by 0.2. @param c  cosine between w_i and w_o's mirror image.
template <class T>
LF_HD inline T reflected_at_most(T c, T cos_i) {
  const T lobe = c > T(0) ? c : T(0);
  const T c2 = lobe * lobe;
  return (T(kDiffuseFactor) + T(kGlossyFactor) * c2 * c2 * c2 * c2 * c2) * (cos_i + T(0.2));
}

// Reflected light of one face for all directions at once, written for the processor's vector units.
// Results do not depend on their width.

/// Directions are padded with zeros to multiples of this number.
inline constexpr Eigen::Index kLanes = 8;

[[nodiscard]] inline Eigen::Index padded(Eigen::Index count) {
  return (count + kLanes - 1) / kLanes * kLanes;
}

/// x of all directions, then y, then z.
template <class T>
using LaneVectors = Eigen::Matrix<T, Eigen::Dynamic, 3>;

/// Selects `value` where the direction's flags have `bit`, else 0.
void select_lanes(const std::uint8_t* flags, std::uint8_t bit, const Eigen::VectorXd& value,
                  Eigen::VectorXd& selected);

/// Light by one reflection for every direction, with its derivative
/// along_light·w_l + along_sensor·w_o by a free vector in place of the normal.
struct DirectLanes {
  explicit DirectLanes(Eigen::Index count)
      : value(count), along_light(count), along_sensor(count) {}

  Eigen::VectorXd value;
  Eigen::VectorXd along_light;
  Eigen::VectorXd along_sensor;
};

/// @param lit  1 where the light reaches the face, else 0.
void reflect_directly(const Eigen::Vector3d& n, const LaneVectors<double>& light,
                      const LaneVectors<double>& sensor, const Eigen::VectorXd& lit,
                      DirectLanes& direct);

/// The weighted loss of every direction with its derivatives by the radiance.
struct LossLanes {
  explicit LossLanes(Eigen::Index count)
      : weight(count), value(count), slope(count), curvature(count) {}

  Eigen::VectorXd weight;  ///< Given.
  Eigen::VectorXd value;
  Eigen::VectorXd slope;
  Eigen::VectorXd curvature;  ///< Size of the second derivative at the direct light.
};

/// Sums over the directions.
struct LossSums {
  double value = 0.0;        ///< Σ weight·loss(L)
  Eigen::Vector3d gradient;  ///< Of `value` by the face's normal, through direct light.
  double curvature = 0.0;    ///< Σ weight·loss″(direct)·|∂L/∂n|²
};

/// @param indirect  light added to the direct light. @param lanes  with its weights; receives the
///               summands.
LossSums sum_losses(Loss loss, const DirectLanes& direct, const Eigen::VectorXd& indirect,
                    const LaneVectors<double>& light, const LaneVectors<double>& sensor,
                    LossLanes& lanes);

/// A path by which light reaches face k by way of face q.
struct HitGeometry {
  Eigen::Vector3f n_k;
  Eigen::Vector3f n_q;
  Eigen::Vector3f w;  ///< From k towards q.
};

/// Light by way of q for every direction, and its upper bound when normals turn by about a lobe's
/// width (reflected_at_most()); 1/sr, single precision. @param lit  flags of q.
void reflect_twice(const HitGeometry& hit, const LaneVectors<float>& light,
                   const LaneVectors<float>& sensor, const std::uint8_t* lit,
                   Eigen::VectorXf& value, Eigen::VectorXf& at_most);

}  // namespace lensforge::reflect
