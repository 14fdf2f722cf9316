// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

#include "core/surface/sampled_surface.h"
#include "core/surface/smooth_patch.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// A point of a spline and its derivatives by the parameters, mm and mm per knot cell.
struct SplineFrame {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_u = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_v = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_uu = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_uv = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_vv = Eigen::Vector3d::Zero();

  /// Of the normal, z > 0 where the spline is a height field; any length.
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
  /// One coordinate of all control points as a table, row index along u.
  [[nodiscard]] Eigen::MatrixXd table(int coordinate) const;

  /// @pre 0 ≤ uv ≤ cells().
  [[nodiscard]] SplineFrame at(const Eigen::Vector2d& uv) const;
  /// Parameters of the point above xy, by Newton's method from `start`; the nearest parameters in
  /// the rectangle where xy lies outside by rounding.
  [[nodiscard]] Eigen::Vector2d parameters_of(const Eigen::Vector2d& xy,
                                              const Eigen::Vector2d& start) const;
};

/// A spline on an even grid of its parameters.
/// @param samples  nodes a knot cell each way, ≥ 1; the nodes include all knots.
SampledSurface spline_nodes(const ControlNet& net, int samples);

/// Rows first … last of spline_nodes(), a surface of their own.
/// @pre 0 ≤ first < last ≤ samples × knot cells along v.
SampledSurface spline_rows(const ControlNet& net, int samples, int first, int last);

/// Nodes a knot cell each way of a mesh that stands for the spline, as surface.ply does.
inline constexpr int kMeshSamples = 2;

/// Nodes at which a spline is looked at for its picture, about. The 128² portrait of 102,400 knot
/// cells has MAE 0.00061, 0.00075 and 0.00080 with 2, 4 and 8 nodes a cell each way.
inline constexpr double kPictureNodes = 4e6;

/// Nodes a knot cell each way, 2 … 256, that make so many of so many cells; above 250,000 nodes
/// not more than 8, which show the same picture.
int samples_for(double nodes, double cells);

/// Nodes a knot cell each way for a spline's picture.
inline int picture_samples(const ControlNet& net) {
  return samples_for(kPictureNodes, static_cast<double>(net.cell_count()));
}

/// spline_nodes() for its picture.
inline SampledSurface picture_nodes(const ControlNet& net) {
  return spline_nodes(net, picture_samples(net));
}

}  // namespace lensforge
