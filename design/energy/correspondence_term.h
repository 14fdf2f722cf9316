// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "core/compute/host_device.h"
#include "design/energy/weights.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {

/// Where transport wants the light of every face (Sun et al., section 3.4).
struct Correspondence {
  Eigen::Matrix2Xd centroids;  ///< c̃ of Eq. 22, pixel coordinates, 2 × F.
  Eigen::VectorXd flux;        ///< Φ^old of Eq. 23, shares of the lens's total, F.
};

struct CorrespondenceValues {
  double align = 0.0;  ///< Square pixels.
  double flux = 0.0;   ///< Squared flux, in units of the mean pixel's.
};

/// One face's share of E_align = ‖c' − c̃‖² and E_flux = (Φ − Φ^old)² (Sun et al., Eqs. 21 and 23).
/// Adds weights.align and weights.flux × the derivatives to `bar`.
/// @param pixels  number of pixels: the lens's flux is counted as that many, so that Eq. 20's
///        weights mean the same at every resolution.
LF_HD inline CorrespondenceValues correspondence_term(const ImageTriangle& t,
                                                      const Eigen::Vector2d& wanted_centroid,
                                                      double wanted_flux, double pixels,
                                                      const ObjectiveWeights& weights,
                                                      ImageTriangle& bar) {
  const Eigen::Vector2d offset = (t.p0 + t.p1 + t.p2) / 3.0 - wanted_centroid;
  const double excess = pixels * (t.flux - wanted_flux);
  const Eigen::Vector2d corner_bar = (2.0 / 3.0 * weights.align) * offset;
  bar.p0 += corner_bar;
  bar.p1 += corner_bar;
  bar.p2 += corner_bar;
  bar.flux += 2.0 * weights.flux * pixels * excess;
  return {offset.squaredNorm(), excess * excess};
}

}  // namespace lensforge
