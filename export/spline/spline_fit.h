// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

#include "core/compute/executor.h"
#include "core/lens/smooth_surface.h"
#include "core/mesh/surface_mesh.h"
#include "export/spline/spline_net.h"

namespace lensforge {

/// Difference between the picture that a surface projects and the wanted one.
struct PictureMiss {
  double excess = 0.0;  ///< Its MAE minus the MAE of the wanted picture.
  /// Per point: missing flux where the point's light lands, wanted − projected, relative to an
  /// evenly lit picture.
  Eigen::VectorXd missing;
};

/// The picture that a fit should keep. The caller supplies the optics.
struct PictureGoal {
  double reach = 0.0;  ///< WantedPicture::reach(); not 0 if a picture is to be kept.
  /// Derivative of the landing point with respect to the surface point (columns: x, y), from the
  /// point, its slope, and the slope's derivative. Empty: 1 + reach × slope derivative, as for
  /// parallel light behind a flat front.
  std::function<Eigen::Matrix2d(const Eigen::Vector3d&, const Eigen::Vector2d&,
                                const Eigen::Matrix2d&)>
      stretch;
  std::function<PictureMiss(const SampledSurface&)> miss;  ///< Empty: no picture is to be kept.
};

struct FitOptions {
  double tolerance = 1e-4;         ///< mm, > 0; on SplinePatch::error.height
  double normal_tolerance = 1e-4;  ///< rad, > 0; on SplinePatch::error.normal
  /// Maximum number of control points of all patches; it bounds the file's size (about 72 bytes
  /// each). 0: four per vertex of the mesh, at most kMaxControlPoints.
  std::int64_t max_control_points = 0;
  bool one_patch = false;  ///< The whole spline as one patch, from which an outline can be cut.
  PictureGoal picture;     ///< Kept by a fit that cannot hold the tolerances.
};

/// Height difference and angle between the normals of two surfaces at a point.
FitError difference(const SurfacePoint& a, const SurfacePoint& b);

[[nodiscard]] bool holds(const FitError& error, const FitOptions& options);

/// Fits one spline to the vertex-normal model over the surface's rectangle by least squares, slopes
/// before heights, and cuts it into a net of patches. Seen from above, its knot lines follow the
/// vertices of a moved grid (GridWarp): knots are dense where vertices are. Knots are doubled until
/// both tolerances hold everywhere or the control points are used up; net.error() states the
/// errors. If a tolerance fails, heights are adjusted until the spline projects the model's picture
/// (options.picture).
/// @pre the surface covers its whole box. @throw Interrupted.
SplineNet fit_spline_net(const SmoothSurface& surface, const FitOptions& options,
                         const Executor& executor, const RunControl& control);

/// Maximum number of control points of fit_spline_net()'s result.
std::int64_t most_control_points(const SmoothSurface& surface, const FitOptions& options);

/// Differences between a patch and the surface on a raster of `density` points a knot cell
/// each way, borders included.
FitError measure_patch(const SplinePatch& patch, const SmoothSurface& surface,
                       const FitOptions& options, int density);

/// Minimum (given enough control points) and maximum number of knot cells of a patch each way,
/// unless the net is one patch.
inline constexpr int kFewestCells = 4;
inline constexpr int kMaxCells = 256;
/// Maximum number of knot cells of a whole net each way: time grows with its third power.
inline constexpr int kMaxCellsAcross = 2048;

/// Number that fits in a STEP file of 45 MB.
inline constexpr std::int64_t kMaxControlPoints = 575'000;

/// Raster of the certificate: points each way in a cell of the mesh, and the minimum in a knot
/// cell.
inline constexpr int kCertificateDensity = 6;
inline constexpr int kMinDensity = 3;

/// The certificate is the largest error on its raster and at the mesh's vertices times this.
inline constexpr double kCertificateMargin = 1.25;

/// Lower bound for the normal error of any surface against a vertex-normal model, whatever its
/// knots and patches, even if it is broken along every edge of the mesh.
struct NormalBound {
  double largest = 0.0;                          ///< Minimum of the largest normal error, rad,
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  ///< in the triangle with this centroid.
  double share_above = 0.0;  ///< Area share of triangles where no surface holds the tolerance.
};

/// Around a triangle ∮ ∇z·dl = 0 for any surface z; hence |s − ∇z| ≥ |∮ s·dl| / perimeter somewhere
/// on its border, for the model's slopes s. To first order the angle is that divided by 1 + |s|².
/// @param tolerance  rad
NormalBound normal_bound(const SmoothSurface& surface, double tolerance);

}  // namespace lensforge
