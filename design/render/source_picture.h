// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/lens.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"
#include "design/render.h"

namespace lensforge {

/// Picture from values in double precision, row by row from the top. @pre columns × rows values.
inline Image image_of(std::span<const double> values, int columns, int rows) {
  Image image(columns, rows);
  std::transform(values.begin(), values.end(), image.values().begin(),
                 [](double value) { return static_cast<float>(value); });
  return image;
}

/// Computes the share of the light in every pixel, lit from a single point or direction.
using PointPicture = std::function<std::vector<double>(const OpticalSetup&)>;

/// Number of source points for an exact picture; it grows with the width of the source's image.
int source_point_count(const OpticalSetup& setup, double z);

/// Flux per pixel under an extended source and all colours of a spectrum: the weighted sum of the
/// pictures under about `count` of its points. The number of points is the only approximation.
/// @param control  takes a report of every point's picture.
std::vector<double> picture_under(const OpticalSetup& setup, int count, const PointPicture& picture,
                                  const RunControl& control = {});

/// The same picture by a convolution with source_kernel().
/// @param z  of the surface, mm.
std::vector<double> picture_by_convolution(const OpticalSetup& setup, double z,
                                           const PointPicture& picture, const Executor& executor);

/// A point's picture by few and by many rays.
struct RayPictures {
  PointPicture few;
  PointPicture many;
};

/// picture_under() with few rays from every point, and by convolution what more rays change.
/// @param z  of the surface, mm.
std::vector<double> picture_under_few_rays(const OpticalSetup& setup, double z, int count,
                                           const RayPictures& rays, const Executor& executor,
                                           const RunControl& control = {});

/// Picture to optimise for, so that the exact picture becomes `target`: the target minus the
/// current error of the optimiser's own approximation, at least 0.
/// @param exact, seen  shares of the light in every pixel of the target, exact and as approximated.
Image corrected(const Image& target, const std::vector<double>& exact,
                const std::vector<double>& seen);

/// flux_of_lens() under about `count` of the source's points.
std::vector<double> flux_under_source(const Lens& lens, const OpticalSetup& setup, int count,
                                      const Executor& executor, const RunControl& control = {});

/// @pre the lens's source has an extent.
SourceCheck check_source(const Lens& lens, const Executor& executor,
                         const RunControl& control = {});

/// The best picture that any surface can project under an extended source, assuming that light is
/// even within each part of a pixel (SourceKernel) and that one kernel holds for the whole lens.
struct SourceLimit {
  Image light;           ///< μ: picture of such a surface under a point source.
  ImageMetrics metrics;  ///< k∗μ against the target.
};

/// Minimises Σ (g − g̃)² over μ ≥ 0 with Σμ = Σ target, where g is the display-encoded k∗μ and g̃
/// the display-encoded target: the limit of the PSNR, and of E_img of Sun et al., Eq. 5. All of the
/// lens's light is on the picture before the blur.
/// @param z  of the surface, mm. @pre the source has an extent; target has setup.pixels.
/// @throw Interrupted if the executor is stopped.
SourceLimit source_limit(const Image& target, const OpticalSetup& setup, double z,
                         const Executor& executor);

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
