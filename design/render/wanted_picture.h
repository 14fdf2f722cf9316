// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// The picture that a mesh projects by its vertex normals, and the difference of other surfaces'
/// pictures from it.
class WantedPicture {
 public:
  /// Keeps references to target and executor. @pre target has setup.pixels columns and rows.
  WantedPicture(const SurfaceMesh& mesh, const OpticalSetup& setup, const Image& target,
                const Executor& executor);

  struct Comparison {
    double excess = 0.0;  ///< MAE against the target minus that of the wanted picture.
    /// Per vertex: wanted − projected flux at its landing point, interpolated linearly between the
    /// pixels' centres, relative to an evenly lit picture.
    Eigen::VectorXd missing;
  };

  /// Compares a smooth surface given by its own normals, 3 × V with z > 0.
  [[nodiscard]] Comparison compare(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals) const;

  /// Derivative of a surface point's landing point on the screen, mm, by x and y (columns), for a
  /// surface with this slope and this derivative of the slope by x and y (columns). The identity
  /// where no light leaves.
  [[nodiscard]] Eigen::Matrix2d stretch(const Eigen::Vector3d& p, const Eigen::Vector2d& slope,
                                        const Eigen::Matrix2d& bend) const;

  /// Distance that light moves on the receiving plane per unit of slope, mm, to first order;
  /// negative if it moves against the slope, as a mirror's light does.
  [[nodiscard]] double reach() const { return reach_; }

 private:
  OpticalSetup setup_;  ///< With the source's middle point alone: its picture is the sharpest.
  LightPath light_;
  const Image& target_;
  const Executor& executor_;
  Image wanted_;
  double mae_ = 0.0;
  double reach_;
};

}  // namespace lensforge
