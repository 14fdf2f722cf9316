// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SparseCore>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/mesh/surface_mesh.h"

namespace lensforge {

// Cubic B-splines over [0, cells] with a knot at every whole number, fourfold at both ends: cells
// + 3 coefficients; the ends' values are the first and last one.
inline constexpr int kSplineDegree = 3;

/// The four basis functions that are not zero at a point: numbers first … first + 3.
struct CubicBasis {
  int first = 0;
  std::array<double, 4> value{};
  std::array<double, 4> slope{};  ///< Derivatives by t.
  std::array<double, 4> bend{};   ///< Second derivatives.
};

/// @pre 0 ≤ t ≤ cells, cells ≥ 1.
CubicBasis cubic_basis(double t, int cells);

/// Greville point of coefficient `i`: with these as coefficients the spline is t itself.
double greville_point(int i, int cells);

/// One row per point with the values (or slopes) of all cells + 3 basis functions.
Eigen::SparseMatrix<double, Eigen::RowMajor> basis_matrix(const std::vector<double>& points,
                                                          int cells, bool slopes);

/// Matrix that maps coefficients from … to + 2 of a spline over [0, cells] to the coefficients over
/// [0, to − from] of the same spline between its knots `from` and `to` (Oslo algorithm).
/// @pre 0 ≤ from < to ≤ cells.
Eigen::MatrixXd restriction(int cells, int from, int to);

// The spline surface of a lens.

/// Height of a surface above a point with all derivatives up to the second.
struct SurfaceShape {
  double z = 0.0;                                   ///< mm
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< ∂z/∂x, ∂z/∂y
  Eigen::Matrix2d bend = Eigen::Matrix2d::Zero();   ///< Second derivatives, 1/mm, symmetric.
};

/// A point of a spline and its derivatives by the parameters, mm and mm per knot cell.
struct SplineFrame {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_u = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_v = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_uu = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_uv = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_vv = Eigen::Vector3d::Zero();

  /// Normal of any length; z > 0 where the spline is a height field.
  [[nodiscard]] Eigen::Vector3d normal() const { return by_u.cross(by_v); }
  /// Height and its derivatives by x and y. @pre normal().z() > 0.
  [[nodiscard]] SurfaceShape shape() const;
};

/// A lens's optical surface as one C² spline: a tensor product of cubic B-splines in x, y and z
/// over the parameters 0 ≤ u ≤ cells.x, 0 ≤ v ≤ cells.y with a knot at every whole number, fourfold
/// at the ends. Its rim is the lens's rectangle, side for side.
struct ControlNet {
  GridShape shape;          ///< Control points along u and v: three more than knot cells, ≥ 4.
  Eigen::Matrix3Xd points;  ///< mm, lens frame; point (i, j) is j·columns + i.

  [[nodiscard]] Eigen::Vector2i cells() const { return {shape.columns - 3, shape.rows - 3}; }
  [[nodiscard]] std::int64_t cell_count() const {
    return std::int64_t{shape.columns - 3} * (shape.rows - 3);
  }
  /// One coordinate of all control points as a matrix, row index along u.
  [[nodiscard]] Eigen::MatrixXd table(int coordinate) const;

  /// @pre 0 ≤ uv ≤ cells().
  [[nodiscard]] SplineFrame at(const Eigen::Vector2d& uv) const;
  /// Parameters of the point above xy, by Newton's method from `start`; the nearest valid
  /// parameters if rounding puts xy outside.
  [[nodiscard]] Eigen::Vector2d parameters_of(const Eigen::Vector2d& xy,
                                              const Eigen::Vector2d& start) const;
};

/// Samples a spline on an even grid of its parameters.
/// @param samples  nodes per knot cell each way, ≥ 1; the nodes include all knots.
SampledSurface spline_nodes(const ControlNet& net, int samples);

/// Rows first … last of spline_nodes() as a separate surface.
/// @pre 0 ≤ first < last ≤ samples × knot cells along v.
SampledSurface spline_rows(const ControlNet& net, int samples, int first, int last);

/// Nodes per knot cell each way in a mesh that represents the spline, such as surface.ply.
inline constexpr int kMeshSamples = 2;

/// Approximate number of nodes used to render a spline. The 128² portrait of 102,400 knot cells has
/// MAE 0.00075 with 4 nodes per cell each way, 0.00080 with 8.
inline constexpr double kPictureNodes = 4e6;

/// Nodes per knot cell each way, 2 … 256, that make about `nodes` nodes of `cells` cells; above
/// 250,000 nodes at most 8, since more show the same picture.
int samples_for(double nodes, double cells);

/// Nodes per knot cell each way to render a spline.
inline int picture_samples(const ControlNet& net) {
  return samples_for(kPictureNodes, static_cast<double>(net.cell_count()));
}

/// spline_nodes() for rendering.
inline SampledSurface picture_nodes(const ControlNet& net) {
  return spline_nodes(net, picture_samples(net));
}

/// Writes surface.spline (docs/interface.md), whole or not at all, exact to the bit.
/// @throw RunError if it cannot be written.
void write_spline(const ControlNet& net, const std::filesystem::path& path);

/// Reads surface.spline back. @throw InputError naming the file and what is wrong if it is missing,
///        of another version, truncated, or holds a number that is not finite.
ControlNet read_spline(const std::filesystem::path& path);

/// True if this file begins with the magic of write_spline().
bool is_spline_file(const std::filesystem::path& path);

}  // namespace lensforge
