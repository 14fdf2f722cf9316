// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace lensforge::reflect {

/// Directions towards the light with the weights of a quadrature over them.
struct DirectionSet {
  Eigen::Matrix3Xd light;  ///< Unit vectors.
  Eigen::VectorXd weight;  ///< They sum to 1.

  [[nodiscard]] Eigen::Index count() const { return light.cols(); }
};

/// How finely a band of directions is sampled.
struct BandSampling {
  int rows = 6;       ///< Heights: Gauss points in z.
  int columns = 48;   ///< Azimuths of a row; neighbouring rows are staggered.
  double turn = 0.0;  ///< Turns all about z, as a share of the distance of two azimuths.
};

/// The band |elevation| ≤ `elevation` about the z axis, every solid angle with the same weight
/// (Tojo et al., 4.1): exact for polynomials in z of degree 2·rows − 1.
/// @param elevation  rad, above 0, at most π/2. @pre rows, columns ≥ 1
DirectionSet band_directions(double elevation, const BandSampling& sampling);

/// Towards the sun on its half circle from east (+x, angle 0) over noon, (0, −1, 1)/√2, to west.
Eigen::Vector3d sun_direction(double angle);

/// `count` directions of the sun at even angles, none of them on the horizon. @pre count ≥ 1
DirectionSet sun_directions(int count);

/// Directions as given, with equal weights. @pre none has length 0
DirectionSet listed_directions(const Eigen::Matrix3Xd& towards_light);

/// Unit directions spread evenly over the half sphere z > 0: a Fibonacci lattice (González 2010).
/// 3 × count.
Eigen::Matrix3Xd hemisphere_directions(int count);

}  // namespace lensforge::reflect
