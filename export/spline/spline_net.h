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
#include "core/lens/optical_surface.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/front.h"
#include "core/optics/outline.h"
#include "core/spline/control_net.h"

namespace lensforge {

/// Error of a fit against the smooth surface's heights and the vertex-normal model's normals
/// (SmoothSurface::model_at()).
struct FitError {
  double height = 0.0;      ///< Largest, mm along z
  double normal = 0.0;      ///< Largest angle, rad
  double height_rms = 0.0;  ///< Root mean square over the parameters
  double normal_rms = 0.0;
  double area = 0.0;                                    ///< mm², seen from above
  double area_within = 0.0;                             ///< Where both tolerances hold
  Eigen::Vector2d height_at = Eigen::Vector2d::Zero();  ///< x, y of the largest error, mm
  Eigen::Vector2d normal_at = Eigen::Vector2d::Zero();

  [[nodiscard]] double share_within() const { return area > 0.0 ? area_within / area : 0.0; }
  /// Takes the other's maximum errors where they are larger.
  void raise(const FitError& other);
  /// Adds a point's errors, with squares for the RMS values. divide() then completes the means,
  /// given the number of points and the parameters' area.
  void add(FitError other, const Eigen::Vector2d& at);
  void divide(double points, double unit_area);
};

/// A point of a height field: position seen from above, height and slopes.
struct SplinePoint {
  Eigen::Vector2d xy = Eigen::Vector2d::Zero();  ///< mm
  SurfacePoint surface;
};

/// Returns the point with these coordinates and derivatives by two parameters.
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
  Eigen::AlignedBox2d box;  ///< Of the parameters (u, v): mm on the lens while its grid is flat.
  int cells_u = 0;
  int cells_v = 0;
  /// Coefficients of x, y and z in mm, (cells_u + 3) × (cells_v + 3) each; row index along u.
  std::array<Eigen::MatrixXd, 3> coefficients;
  FitError error;  ///< Certificate: error bound for every point of the patch.

  [[nodiscard]] Eigen::Vector2d cells() const { return Eigen::Vector2d(cells_u, cells_v); }
  /// @pre uv lies in the box, as for frame().
  [[nodiscard]] PatchFrame frame(const Eigen::Vector2d& uv) const;
  [[nodiscard]] SplinePoint at(const Eigen::Vector2d& uv) const;
  /// Volume between the patch and z = 0, mm³; exact.
  [[nodiscard]] double volume() const;
};

/// x, y, z of a patch and their derivatives on a tensor grid of points (in cells), one row per u.
class PatchTable {
 public:
  PatchTable(const SplinePatch& patch, const std::vector<double>& u, const std::vector<double>& v);

  [[nodiscard]] Eigen::Index rows() const { return value_[0].rows(); }
  [[nodiscard]] Eigen::Index columns() const { return value_[0].cols(); }
  [[nodiscard]] SplinePoint at(Eigen::Index i, Eigen::Index j) const {
    return spline_point(take(value_, i, j), take(by_u_, i, j), take(by_v_, i, j));
  }
  /// Area covered by a unit of the parameters, seen from above.
  [[nodiscard]] double area(Eigen::Index i, Eigen::Index j) const {
    return by_u_[0](i, j) * by_v_[1](i, j) - by_u_[1](i, j) * by_v_[0](i, j);
  }
  [[nodiscard]] double volume(Eigen::Index i, Eigen::Index j) const {
    return value_[2](i, j) * area(i, j);
  }

 private:
  using Table = std::array<Eigen::MatrixXd, 3>;
  static Eigen::Vector3d take(const Table& table, Eigen::Index i, Eigen::Index j) {
    return {table[0](i, j), table[1](i, j), table[2](i, j)};
  }
  Table value_, by_u_, by_v_;
};

/// Edge between two patches or on the rim: a cubic B-spline that both patches contain.
struct SplineEdge {
  int cells = 0;
  Eigen::Matrix3Xd coefficients;  ///< 3 × (cells + 3), mm
};

/// Index of (column, row) in a row-major table with `columns` columns.
inline std::size_t table_index(int column, int row, int columns) {
  return static_cast<std::size_t>(std::int64_t{row} * columns + column);
}

/// A rectangle tiled with spline patches that join with equal heights, slopes and curvatures, and
/// the face below it. The parameters' rectangle is the lens's own.
struct SplineNet {
  int columns = 0;
  int rows = 0;
  std::vector<double> u;             ///< columns + 1 lines, mm
  std::vector<double> v;             ///< rows + 1 lines, mm
  std::vector<SplinePatch> patches;  ///< Patch (column, row) is row·columns + column.
  std::vector<SplineEdge> edges_u;   ///< Along u: edge (column, line) is line·columns + column.
  std::vector<SplineEdge> edges_v;   ///< Along v: edge (line, row) is row·(columns + 1) + line.
  /// The face below; none: the plane z = 0. @pre a sphere's radius is longer than half of the
  /// diagonal, a height map spans the rectangle.
  std::optional<Front> front;
  /// The edge of the solid; none: the rectangle. @pre with an outline there is one patch.
  std::optional<Outline> outline;

  [[nodiscard]] FitError error() const;
  /// Volume between the patches and the face below, mm³; exact, or outlined_volume() with an
  /// outline.
  [[nodiscard]] double volume() const;
  [[nodiscard]] std::int64_t control_points() const;
  /// @pre uv lies in the rectangle.
  [[nodiscard]] SplinePoint at(const Eigen::Vector2d& uv) const;
  /// Index of the patch that contains a point of the parameters.
  [[nodiscard]] int patch_at(const Eigen::Vector2d& uv) const;
  /// Parameters of the point above xy by Newton's method from `start`; empty if it does not
  /// converge.
  [[nodiscard]] std::optional<Eigen::Vector2d> parameters_of(const Eigen::Vector2d& xy,
                                                             const Eigen::Vector2d& start) const;
};

/// The net's surface and its own normals at columns × rows points, evenly spaced in the parameters.
SampledSurface sampled(const SplineNet& net, const GridShape& shape);

/// Volume between a curved front and the plane z = 0 over a rectangle, mm³; negative where the
/// front lies below the plane. Exact except for rounding. @pre the front covers the rectangle.
double volume_below(const Front& front, const Eigen::AlignedBox2d& box);

/// A height map over its rectangle as one patch: the same surface with fourfold end knots.
SplinePatch patch_of(const HeightFront& front);

/// One bicubic spline over a rectangle of parameters, even knots clamped at the rim.
struct WholeSpline {
  Eigen::AlignedBox2d box;  ///< Box of the parameters.
  /// Coefficients of x, y and z in mm, row index along u.
  std::array<Eigen::MatrixXd, 3> coefficients;
};

/// Knot indices at which the spline is cut, ascending, including the first and the last.
struct CutLines {
  std::vector<int> u;
  std::vector<int> v;
};

/// The same surface as a net of patches. Inner coefficients are only rounded; those next to a cut
/// come from the Oslo algorithm. @param step  mm; coefficients are rounded to multiples of it.
SplineNet cut_spline(const WholeSpline& whole, const CutLines& lines, double step,
                     const Executor& executor);

/// A lens's own spline as a net of patches: nothing is fitted. Coordinates are the control points',
/// rounded to 1e-10 mm.
SplineNet net_of(const ControlNet& spline, const Executor& executor);

/// A lens's own spline as one patch.
SplineNet patch_of(const ControlNet& spline, const Executor& executor);

/// Number of control points of net_of().
std::int64_t control_points_of_net(const ControlNet& spline);

// A solid with an outline.

/// A quarter of a circle seen along z, counter-clockwise; mm, rad.
struct WallArc {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double radius = 0.0;
  double start = 0.0;  ///< Angle from +x.
};

/// One smooth part of a lens's edge, seen along z: a straight line or a quarter of a circle.
struct OutlineWall {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();  ///< mm
  Eigen::Vector2d to = Eigen::Vector2d::Zero();
  std::optional<WallArc> arc;

  /// Parameter of the end: mm along a line, rad along an arc. It is 0 at the start.
  [[nodiscard]] double last() const;
  [[nodiscard]] Eigen::Vector2d at(double t) const;
  /// Derivative of at().
  [[nodiscard]] Eigen::Vector2d along(double t) const;
  /// mm
  [[nodiscard]] double length() const;
};

/// Returns the nominal edge of a lens, counter-clockwise, with true arcs instead of chords. Polygon
/// corners closer than kShortestWall to the previous one are omitted.
std::vector<OutlineWall> walls_of(const Outline& outline);

/// Shortest wall, mm: far above the tolerance of a solid's edges, far below the precision of a
/// mill.
inline constexpr double kShortestWall = 1e-3;

/// Volume between a net of one patch and the face below it inside of the net's outline, mm³:
/// Gauss's rule in the knot cells inside; small triangles, clipped at the outline, in those that it
/// crosses; arcs are exact. Relative error below 1e-7 (OutlineVolume.IsTheIntegral).
/// @pre net.outline; one patch.
double outlined_volume(const SplineNet& net);

}  // namespace lensforge
