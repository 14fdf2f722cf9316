// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cam/tolerance/part_error.h"
#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// Lamp and screen as a part sees them that is turned about the lens's middle.
/// @param tilt  about x, then about y, rad.
OpticalSetup seen_by_turned_part(OpticalSetup setup, const Eigen::Vector2d& tilt);

/// Places on a part before thermal growth, mm: a grid, row by row.
struct PartNodes {
  std::size_t columns = 0;
  std::vector<Eigen::Vector3d> places;
};

/// Light path to the screen through a part with errors: turned about its centre, with another
/// refractive index, grown, and with the screen farther away along its own axis. Lamp and screen
/// stay in place. A curved front turns with the part but does not grow: of 10 K that is some
/// 0.01 mm aside at the rim of a lens of 25 mm.
class PartLight {
 public:
  PartLight(const OpticalSetup& setup, const PartError& error);

  /// A point of the grown part, from its place and height in the lens frame, mm.
  [[nodiscard]] Eigen::Vector3d grown(const Eigen::Vector2d& place, double z) const {
    return centre_ + growth_ * (Eigen::Vector3d(place.x(), place.y(), z) - centre_);
  }
  /// True if rays differ from point to point and have to be solved for.
  [[nodiscard]] bool varies() const { return light_.varies(); }
  /// The ray to such a point. @pre varies().
  [[nodiscard]] IncidentRay ray_to(const Eigen::Vector3d& point) const {
    return light_.ray_to(point);
  }
  /// Landing place of the ray from such a point, in pixel coordinates; NaN if it misses the screen.
  /// @param known  ray_to(point), if at hand.
  [[nodiscard]] Eigen::Vector2d land(const Eigen::Vector3d& point, const Eigen::Vector2d& slope,
                                     const IncidentRay* known = nullptr) const;
  /// Light on a triangle of such points, mm² (LightPath::intake()).
  [[nodiscard]] double intake(const Corners& triangle, const CornerRays& known = {}) const {
    return light_.intake(triangle, known);
  }
  /// Light on the whole part, mm²: for light along a lens's axis its grown area, else the light
  /// through the triangles between its nodes. That hardly depends on their number: the light
  /// through the part follows from its rim.
  [[nodiscard]] double whole(const PartNodes& nodes) const;
  /// Slope that sends the light of the part's middle, at height z, to the picture's middle; for
  /// parallel light, that of a flat part.
  [[nodiscard]] Eigen::Vector2d slope_of_middle(double z) const;
  /// Movement of the light on the screen per change of slope along an axis, pixels; NaN where no
  /// light leaves.
  [[nodiscard]] Eigen::Vector2d moved_by(const Eigen::Vector3d& point, const Eigen::Vector2d& slope,
                                         int axis) const;
  /// Half axes, along the picture's x and y, of the spot lit by a point of height z in the middle
  /// under a source of this full angle (rad), as seen by the part, pixels: to first order.
  [[nodiscard]] Eigen::Vector2d source_radii(double angle, double z) const;

 private:
  OpticalSetup seen_;  ///< In the part's own frame.
  LightPath light_;
  Eigen::Vector3d centre_;
  double growth_;
  bool straight_;
  double screen_;  ///< z of a screen parallel to the part, mm.
};

/// Shares of a pixel's flux that move by −reach … reach pixels, over a square, row by row; all ≥ 0
/// with the sum 1.
struct BlurKernel {
  std::int64_t reach = 0;
  std::vector<double> share{1.0};
};

/// Blur kernel of a source whose image through every place of the part is an evenly lit disc, or an
/// ellipse with these half axes along x and y, pixels, ≥ 0. Movement by a fraction of a pixel is
/// split between neighbours, which widens the blur; the disc is reduced so that the kernel's
/// variance is the disc's own, radius² / 4 along either axis.
BlurKernel disc_blur(const Eigen::Vector2d& radii);

/// Flux of a picture, row by row.
struct FluxRaster {
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  std::vector<double> flux;
};

/// The raster convolved with the kernel. Flux moved off the raster is lost, and none comes from
/// outside.
FluxRaster blurred(const FluxRaster& raster, const BlurKernel& kernel, const Executor& executor);

}  // namespace lensforge
