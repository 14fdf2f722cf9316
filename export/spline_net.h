// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/optics/front_surface.h"
#include "core/optics/outline.h"
#include "core/surface/sampled_surface.h"
#include "core/surface/smooth_surface.h"
#include "export/picture_goal.h"

namespace lensforge {

/// How far a fit is from the smooth surface's heights and from the normals of the vertex-normal
/// model (SmoothSurface::model_at()).
struct FitError {
  double height = 0.0;      ///< Largest, mm along z
  double normal = 0.0;      ///< Largest angle, rad
  double height_rms = 0.0;  ///< Root of the mean square over the parameters
  double normal_rms = 0.0;
  double area = 0.0;                                    ///< mm², seen from above
  double area_within = 0.0;                             ///< Where both tolerances hold
  Eigen::Vector2d height_at = Eigen::Vector2d::Zero();  ///< x, y of the largest ones, mm
  Eigen::Vector2d normal_at = Eigen::Vector2d::Zero();

  [[nodiscard]] double share_within() const { return area > 0.0 ? area_within / area : 0.0; }
  /// Takes the other's largest errors where they are larger.
  void raise(const FitError& other);
  /// Adds a point's errors, squares for roots of means; divide() ends this, with the points and
  /// the parameters' area.
  void add(FitError other, const Eigen::Vector2d& at);
  void divide(double points, double unit_area);
};

/// A point of a height field, seen from above, and its height and slopes there.
struct SplinePoint {
  Eigen::Vector2d xy = Eigen::Vector2d::Zero();  ///< mm
  SurfacePoint surface;
};

/// The point with these coordinates and derivatives by two parameters.
SplinePoint spline_point(const Eigen::Vector3d& p, const Eigen::Vector3d& du,
                         const Eigen::Vector3d& dv);

/// A point of a patch and its derivatives by the parameters.
struct PatchFrame {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_u = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_v = Eigen::Vector3d::Zero();
};

/// A bicubic B-spline surface over a rectangle of parameters: `cells_u` × `cells_v` knot cells,
/// twice continuously differentiable, one height above every (x, y).
struct SplinePatch {
  Eigen::AlignedBox2d box;  ///< Of the parameters (u, v), mm on the lens while its grid is flat.
  int cells_u = 0;
  int cells_v = 0;
  /// Coefficients of x, y and z in mm, (cells_u + 3) × (cells_v + 3) each; row index along u.
  std::array<Eigen::MatrixXd, 3> coefficients;
  FitError error;  ///< Certificate: no point of the patch is farther off.

  [[nodiscard]] Eigen::Vector2d cells() const { return Eigen::Vector2d(cells_u, cells_v); }
  /// @pre uv lies in the box, as for frame().
  [[nodiscard]] PatchFrame frame(const Eigen::Vector2d& uv) const;
  [[nodiscard]] SplinePoint at(const Eigen::Vector2d& uv) const;
  /// Volume between the patch and z = 0, mm³; exact.
  [[nodiscard]] double volume() const;
};

/// A line between two patches, or on the rim: a cubic B-spline that both patches contain.
struct SplineEdge {
  int cells = 0;
  Eigen::Matrix3Xd coefficients;  ///< 3 × (cells + 3), mm
};

/// Place of (column, row) in a table with `columns` columns that is stored row by row.
inline std::size_t table_index(int column, int row, int columns) {
  return static_cast<std::size_t>(std::int64_t{row} * columns + column);
}

/// A rectangle tiled with spline patches that join with equal heights, slopes and curvatures, and
/// the face below it. The parameters' rectangle is the lens's own, corner for corner and side for
/// side.
struct SplineNet {
  int columns = 0;
  int rows = 0;
  std::vector<double> u;             ///< columns + 1 lines, mm
  std::vector<double> v;             ///< rows + 1 lines, mm
  std::vector<SplinePatch> patches;  ///< Patch (column, row) is row·columns + column.
  std::vector<SplineEdge> edges_u;   ///< Along u: (column, line) is line·columns + column.
  std::vector<SplineEdge> edges_v;   ///< Along v: (line, row) is row·(columns + 1) + line.
  /// The face below; none: the plane z = 0. @pre a sphere's radius is longer than half of the
  /// diagonal, a height map spans the rectangle.
  std::optional<Front> front;
  /// The edge of the solid; none: the rectangle. @pre with an outline there is one patch.
  std::optional<Outline> outline;

  [[nodiscard]] FitError error() const;
  /// Volume between the patches and the face below, mm³; exact, or as outlined_volume().
  [[nodiscard]] double volume() const;
  [[nodiscard]] std::int64_t control_points() const;
  /// @pre uv lies in the rectangle.
  [[nodiscard]] SplinePoint at(const Eigen::Vector2d& uv) const;
  /// Number of the patch that holds a point of the parameters.
  [[nodiscard]] int patch_at(const Eigen::Vector2d& uv) const;
  /// Parameters of the point above xy by Newton's method from `start`; nothing if it does not
  /// come there.
  [[nodiscard]] std::optional<Eigen::Vector2d> parameters_of(const Eigen::Vector2d& xy,
                                                             const Eigen::Vector2d& start) const;
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

/// The net's surface and its own normals at columns × rows points, evenly over the parameters.
SampledSurface sampled(const SplineNet& net, const GridShape& shape);

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

}  // namespace lensforge
