// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cam/tolerance/part_error.h"
#include "core/compute/executor.h"
#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"
#include "core/surface/corners.h"

namespace lensforge {

/// Places on a part before it has grown, mm: a grid, row by row.
struct PartNodes {
  std::size_t columns = 0;
  std::vector<Eigen::Vector3d> places;
};

/// The light's way to the screen by a part that stands, is made of and is lit as its errors say:
/// turned about its centre, with another refractive index, grown, before a screen that is farther
/// along its own axis. Lamp and screen stay where they are.
class PartLight {
 public:
  PartLight(const OpticalSetup& setup, const PartError& error);

  /// A point of the part as it has grown, from its place and height in the lens frame, mm.
  [[nodiscard]] Eigen::Vector3d grown(const Eigen::Vector2d& place, double z) const {
    return centre_ + growth_ * (Eigen::Vector3d(place.x(), place.y(), z) - centre_);
  }
  /// Where the ray of such a point lands, in pixel coordinates; NaN where none goes to the screen.
  [[nodiscard]] Eigen::Vector2d land(const Eigen::Vector3d& point,
                                     const Eigen::Vector2d& slope) const;
  /// Light that a triangle of such points takes, mm² (LightPath::intake()).
  [[nodiscard]] double intake(const Corners& triangle) const { return light_.intake(triangle); }
  /// What the whole part takes, mm²: of light straight onto a lens its area as it has grown, else
  /// what goes through the triangles between its nodes. That hardly depends on how many there are:
  /// what light goes through follows from the rim.
  [[nodiscard]] double whole(const PartNodes& nodes) const;
  /// Slope that sends the light of the part's middle, at height z, to the picture's; of light that
  /// comes straight, the flat one's.
  [[nodiscard]] Eigen::Vector2d slope_of_middle(double z) const;
  /// How far a change of slope along an axis moves the light over the screen, pixels; NaN where
  /// none leaves.
  [[nodiscard]] Eigen::Vector2d moved_by(const Eigen::Vector3d& point, const Eigen::Vector2d& slope,
                                         int axis) const;
  /// How far along the picture's x and y the spot reaches that a point of height z in the middle
  /// lights with a source of this full angle (rad) as the part sees it, pixels: to first order.
  [[nodiscard]] Eigen::Vector2d source_radii(double angle, double z) const;

 private:
  OpticalSetup seen_;  ///< From the part's own frame.
  LightPath light_;
  Eigen::Vector3d centre_;
  double growth_;
  bool straight_;
  double screen_;  ///< z of one that is parallel to the part, mm.
};

/// Shares of a pixel's flux that go −reach … reach pixels on, over a square row by row; none is
/// below 0, and their sum is 1.
struct BlurKernel {
  std::int64_t reach = 0;
  std::vector<double> share{1.0};
};

/// The blur of a picture by a source of which every place of the part makes an evenly lit disc, or
/// an ellipse with these half axes along x and y, pixels, ≥ 0. What is moved by a part of a pixel
/// is split between its neighbours, which alone would widen the blur; the disc is made so much
/// smaller that the kernel's variance is radius² / 4 along either axis, the disc's own.
BlurKernel disc_blur(const Eigen::Vector2d& radii);

/// Flux of a picture, row by row.
struct FluxRaster {
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  std::vector<double> flux;
};

/// What is moved off the raster is lost, and nothing comes from outside of it.
FluxRaster blurred(const FluxRaster& raster, const BlurKernel& kernel, const Executor& executor);

}  // namespace lensforge
