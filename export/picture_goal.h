// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>

#include "core/surface/sampled_surface.h"

namespace lensforge {

/// How far the picture that a surface projects is from the one that it should project.
struct PictureMiss {
  double excess = 0.0;  ///< By how much its MAE is above that of the wanted picture.
  /// Per point: flux that is missing where the point's light lands, wanted − projected, relative to
  /// an evenly lit picture.
  Eigen::VectorXd missing;
};

/// The picture that a fit is to keep; optics is known to who asks for it.
struct PictureGoal {
  double reach = 0.0;  ///< WantedPicture::reach(), not 0 where a picture is to be kept.
  /// How the landing point of a surface point's light changes with its place (columns: x, y), from
  /// the point, its slope, and how that changes. Empty: as 1 + reach × the last, that of parallel
  /// light behind a flat front.
  std::function<Eigen::Matrix2d(const Eigen::Vector3d&, const Eigen::Vector2d&,
                                const Eigen::Matrix2d&)>
      stretch;
  std::function<PictureMiss(const SampledSurface&)> miss;  ///< Empty: no picture is to be kept.
};

}  // namespace lensforge
