// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>

#include "design/reflect/light/directions.h"
#include "design/reflect/light/goal.h"
#include "design/reflect/reflect_options.h"

namespace lensforge::reflect {

/// Where the light comes from and what it is to do.
struct LightField {
  Goal goal;
  std::optional<Eigen::Matrix3Xd> listed;  ///< --light
  double elevation = 0.0;                  ///< rad
  int rows = 0;
  int sun_positions = 0;

  /// Directions of an update; a band is turned by a golden share of its azimuths from one update to
  /// the next, so that a shape cannot hide between directions.
  [[nodiscard]] DirectionSet directions(int update) const;
  /// A direction drawn from the whole band, the sun's half circle or the list by two numbers in
  /// 0 … 1.
  [[nodiscard]] Eigen::Vector3d random_direction(double u, double v) const;
  /// Finer, for energies that are stated: the band average of a face is exact to 0.1 %.
  [[nodiscard]] DirectionSet evaluation_directions() const;
};

/// @throw InputError naming --place or --light, the value and the rule.
LightField make_light_field(const ReflectOptions& options);

/// Numbers with commas between them. @throw InputError "option text: must be …"
Eigen::VectorXd number_list(const std::string& option, const std::string& text, int count);

}  // namespace lensforge::reflect
