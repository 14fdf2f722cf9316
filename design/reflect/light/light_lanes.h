// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "design/reflect/light/goal.h"

/// Reflected light of one face for all directions at once, written so that the compiler uses the
/// processor's vector units. Every number is the same whatever their width.
namespace lensforge::reflect {

/// Directions are padded with zeros to whole packs of so many.
inline constexpr Eigen::Index kLanes = 8;

[[nodiscard]] inline Eigen::Index padded(Eigen::Index count) {
  return (count + kLanes - 1) / kLanes * kLanes;
}

/// x of all directions, then y, then z.
template <class T>
using LaneVectors = Eigen::Matrix<T, Eigen::Dynamic, 3>;

/// `value` where the direction's flags have `bit`, else 0.
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
  explicit LossLanes(Eigen::Index count) : value(count), slope(count), curvature(count) {}

  Eigen::VectorXd value;
  Eigen::VectorXd slope;
  Eigen::VectorXd curvature;  ///< Size of the second derivative at the direct light.
};

/// Sums over the directions.
struct LossSums {
  double value = 0.0;        ///< Σ weight·loss(L)
  Eigen::Vector3d gradient;  ///< Of the value by the face's normal, through direct light.
  double curvature = 0.0;    ///< Σ weight·loss″(direct)·|∂L/∂n|²
};

/// @param indirect  light to be added to the direct one. @param lanes  receives what is summed.
LossSums sum_losses(Loss loss, const DirectLanes& direct, const Eigen::VectorXd& indirect,
                    const Eigen::VectorXd& weight, const LaneVectors<double>& light,
                    const LaneVectors<double>& sensor, LossLanes& lanes);

/// One way by which light reaches a face: k, by way of another one, q.
struct HitGeometry {
  Eigen::Vector3f n_k;
  Eigen::Vector3f n_q;
  Eigen::Vector3f w;  ///< From k towards q.
};

/// Light by way of q for every direction, and what it is at most when normals turn by about a
/// lobe's width (reflected_at_most()); 1/sr, single precision. @param lit  of q.
void reflect_twice(const HitGeometry& hit, const LaneVectors<float>& light,
                   const LaneVectors<float>& sensor, const std::uint8_t* lit,
                   Eigen::VectorXf& value, Eigen::VectorXf& at_most);

}  // namespace lensforge::reflect
