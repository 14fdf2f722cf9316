// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace lensforge {

/// Marks a facet that is led to no pixel.
inline constexpr std::int32_t kNoPixel = -1;

/// What a facet picture shows and lacks.
struct LitPicture {
  int columns;
  int rows;
  std::span<const double> light;   ///< Linear, row by row from the top.
  std::span<const double> wanted;  ///< The same of the target.
};

/// Finds the pixels that get less than kMinLight of the light they want, and for each the facet
/// that is to go there: the nearest within kUnlitReach pixels that is not on its way to another
/// one, a facet that is alone in its pixel counting as one pixel farther. In the dark, where a
/// pixel is lit by a facet or two, such pixels are most of a facet picture's error.
/// @param centroids  of the facets' images, pixel coordinates, 2 × F; none finite is left out.
/// @return the pixel for every facet, kNoPixel for most.
std::vector<std::int32_t> lead_to_unlit_pixels(const LitPicture& picture,
                                               const Eigen::Matrix2Xd& centroids);

/// The same of the faces that an executor holds: all of them, but for that of design/mpi/.
template <class Exec>
std::vector<std::int32_t> lead_to_unlit_pixels(const Exec& /*executor*/, const LitPicture& picture,
                                               const Eigen::Matrix2Xd& centroids) {
  return lead_to_unlit_pixels(picture, centroids);
}

}  // namespace lensforge
