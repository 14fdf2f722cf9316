// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "tracer/lens_files.h"

namespace tracer {

/// The front of front.exr, as docs/interface.md describes it: a spline through its samples by cubic
/// Hermite pieces, whose slopes at the samples are solved for. Millimetres.
class HeightMap {
 public:
  HeightMap() = default;
  /// @param size  that the samples span.
  HeightMap(const Picture& samples, const Vec2& size);

  struct Point {
    double z;
    Vec2 slope;
  };
  [[nodiscard]] Point at(const Vec2& place) const;

 private:
  Vec2 step_;  ///< Between samples, mm.
  // Values, slopes and twists at the samples, and at one beyond each edge; per sample step.
  Eigen::MatrixXd z_;
  Eigen::MatrixXd by_x_;
  Eigen::MatrixXd by_y_;
  Eigen::MatrixXd by_xy_;
};

}  // namespace tracer
