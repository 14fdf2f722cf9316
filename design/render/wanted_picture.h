// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// The picture that a mesh projects by its vertex normals, and what other surfaces' pictures lack
/// of it.
class WantedPicture {
 public:
  /// Keeps references to target and executor. @pre target has setup.pixels columns and rows.
  WantedPicture(const SurfaceMesh& mesh, const OpticalSetup& setup, const Image& target,
                const Executor& executor);

  struct Comparison {
    double excess = 0.0;  ///< MAE against the target above that of the wanted picture.
    /// Per vertex: wanted − projected flux where its light lands, between the pixels' middles
    /// linearly, relative to an evenly lit picture.
    Eigen::VectorXd missing;
  };

  /// Of a smooth surface that is known by its own normals, 3 × V with z > 0.
  [[nodiscard]] Comparison compare(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals) const;

  /// How the place on the screen where the light of a surface point lands, mm, changes with x and y
  /// (columns), for a surface of this slope and this change of slope with x and y (columns).
  /// 1 where no light leaves.
  [[nodiscard]] Eigen::Matrix2d stretch(const Eigen::Vector3d& p, const Eigen::Vector2d& slope,
                                        const Eigen::Matrix2d& bend) const;

  /// How far light moves on the receiving plane for a unit of slope, mm: to first order. Negative
  /// where it moves against the slope, as a mirror's does.
  [[nodiscard]] double reach() const { return reach_; }

 private:
  OpticalSetup setup_;  ///< In the light of the source's middle alone: its picture is the sharpest.
  LightPath light_;
  const Image& target_;
  const Executor& executor_;
  Image wanted_;
  double mae_ = 0.0;
  double reach_;
};

}  // namespace lensforge
