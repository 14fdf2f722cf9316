// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/optics/optical_setup.h"

namespace lensforge {

/// Where transport takes the light of a flat surface to be, so that its map is one that a surface
/// can make.
///
/// Notation: p a point of the lens; u where a flat surface sends its light, v where the surface of
/// height h does, pixel coordinates; A = ∂u/∂p; K = ∂v/∂(∇h), both at the middle of the lens.
///
/// To first order v = u + K ∇_p h = u + M ∇_u h with M = K Aᵀ. Light from the side, or on a tilted
/// screen, is moved farther by a slope in one direction than in another: by a mirror at 30 degrees
/// 4/3 times as far. Then what moves the light least, by |v − u|², is made by no surface; what has
/// the least cost (v − u)ᵀ M⁻¹ (v − u) is. Its cells are the power cells of the sites M⁻¹ u: this
/// cost differs from |v − M⁻¹ u|² by terms of u alone, which the weights take up, and of v alone.
/// Here M has determinant 1, and sites lie about the picture's centre; in light along z on a screen
/// that is not turned they are u.
class TransportSites {
 public:
  explicit TransportSites(const OpticalSetup& setup);

  /// The site, pixel coordinates, of light that lands at u from a flat surface.
  [[nodiscard]] Eigen::Vector2d site(const Eigen::Vector2d& u) const {
    return centre_ + inverse_ * (u - centre_);
  }
  /// How far light lands elsewhere whose site is that far away.
  [[nodiscard]] Eigen::Vector2d way(const Eigen::Vector2d& site_way) const {
    return motion_ * site_way;
  }

 private:
  Eigen::Matrix2d motion_ = Eigen::Matrix2d::Identity();   ///< M
  Eigen::Matrix2d inverse_ = Eigen::Matrix2d::Identity();  ///< M⁻¹
  Eigen::Vector2d centre_;
};

}  // namespace lensforge
