// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/surface/sampled_surface.h"
#include "core/surface/smooth_surface.h"
#include "export/spline/spline_net.h"

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

struct FitOptions {
  double tolerance = 1e-4;         ///< mm, > 0; on SplinePatch::error.height
  double normal_tolerance = 1e-4;  ///< rad, > 0; on SplinePatch::error.normal
  /// Control points of all patches together at most; what bounds the file's size (about 72 bytes
  /// each). 0: four for each vertex of the mesh, kMaxControlPoints at most.
  std::int64_t max_control_points = 0;
  bool one_patch = false;  ///< The whole spline as one, for an outline to be cut out of.
  PictureGoal picture;     ///< What a fit that cannot hold the tolerances keeps instead.
};

/// Height difference and angle between the normals of two surfaces at a point.
FitError difference(const SurfacePoint& a, const SurfacePoint& b);

[[nodiscard]] bool holds(const FitError& error, const FitOptions& options);

/// Fits one spline to the vertex-normal model over the surface's rectangle by least squares, slopes
/// before heights, and cuts it into a net of patches. Seen from above its knot lines follow the
/// vertices of a grid that has moved (GridWarp), so that knots are dense where vertices are. Until
/// both tolerances hold everywhere, or the control points are used up, the knots are doubled;
/// net.error() says which tolerances hold. Where they do not, heights change until the spline
/// projects the picture that the model projects (options.picture).
/// @pre the surface covers its whole box. @throw Interrupted.
SplineNet fit_spline_net(const SmoothSurface& surface, const FitOptions& options,
                         const Executor& executor, const RunControl& control);

/// Control points that fit_spline_net() ends with at most.
std::int64_t most_control_points(const SmoothSurface& surface, const FitOptions& options);

/// Differences between a patch and the surface on a raster of `density` points a knot cell
/// each way, borders included.
FitError measure_patch(const SplinePatch& patch, const SmoothSurface& surface,
                       const FitOptions& options, int density);

/// Knot cells of a patch each way, at least (given enough control points) and at most, unless one
/// patch is all.
inline constexpr int kFewestCells = 4;
inline constexpr int kMaxCells = 256;
/// Knot cells of a whole net each way at most: time grows with their third power.
inline constexpr int kMaxCellsAcross = 2048;

/// What fits a STEP file of 45 MB.
inline constexpr std::int64_t kMaxControlPoints = 575'000;

/// Raster of the certificate: points each way in a cell of the mesh, and in a knot cell at least.
inline constexpr int kCertificateDensity = 6;
inline constexpr int kMinDensity = 3;

/// The certificate is the largest error on its raster and at the mesh's vertices times this.
inline constexpr double kCertificateMargin = 1.25;

/// How near any surface can come to a vertex-normal model's normals, whatever its knots and
/// patches, even if it breaks along every edge of the mesh.
struct NormalBound {
  double largest = 0.0;  ///< rad: somewhere its normals are off by this at least,
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  ///< in the triangle with this centroid.
  double share_above = 0.0;  ///< Of the area: triangles in which none holds the tolerance.
};

/// Around a triangle the slopes of a surface sum to nothing, ∮ ∇z·dl = 0, so that somewhere on its
/// border |s − ∇z| ≥ |∮ s·dl| / perimeter for the model's slopes s; as an angle, to first order, it
/// is that divided by 1 + |s|². @param tolerance  rad
NormalBound normal_bound(const SmoothSurface& surface, double tolerance);

}  // namespace lensforge
