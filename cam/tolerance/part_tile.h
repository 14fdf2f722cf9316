// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "cam/milled/surface_field.h"
#include "cam/tolerance/base_heights.h"
#include "cam/tolerance/error_heights.h"
#include "cam/tolerance/line_filter.h"
#include "cam/tolerance/part_light.h"
#include "cam/tolerance/ripple.h"
#include "cam/tool/polish_model.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {

/// How a part is rendered along one axis.
struct SceneAxis {
  /// One for every place of a node cell that has a node of its own: the first, or the first and the
  /// middle.
  std::vector<LineFilter> filters;
  bool ripples = false;  ///< Whether scallops are to be seen along it.

  [[nodiscard]] std::int64_t parts() const { return static_cast<std::int64_t>(filters.size()); }
};

/// What every tile of one part is rendered with.
struct PartScene {
  const BaseHeights& base;
  const ErrorHeights& heights;
  const PartLight& light;
  const Ripple& ripple;
  const PolishModel& polish;
  std::array<SceneAxis, 2> axes;
  Eigen::Vector2d lens_size;  ///< mm
  std::int64_t margin = 0;    ///< Pixels around the picture.
  double whole = 0.0;         ///< Light that the part takes, mm², of which fluxes are shares.
  Eigen::Vector2d source{0.0, 0.0};  ///< Half axes of the spot that a point lights, pixels.
};

/// A rectangle of cells of one part: its heights with errors are polished, its nodes' rays are
/// landed, and two triangles a cell are deposited.
class PartTile {
 public:
  /// @param cells  of BaseHeights.
  PartTile(const PartScene& scene, const CellRange& cells);

  void deposit(const FluxAccumulator& image) const;

 private:
  /// Nodes of one axis, those between the base's included.
  struct Nodes {
    std::int64_t parts;  ///< Of a cell of the base.
    std::int64_t first;  ///< One before the tile's.
    std::int64_t count;  ///< Up to one behind it.
    std::int64_t base;   ///< First node of the base that polishing needs.
    std::int64_t bases;  ///< How many.
    double spacing;      ///< mm
  };

  [[nodiscard]] Nodes nodes_of(int axis) const;
  [[nodiscard]] static const LineFilter& filter_of(const SceneAxis& axis, std::int64_t node);
  void polish();
  void polish_line(const double* raw, double* heights, double* slopes) const;
  void take_off_rim();
  void land();
  void sharpen();
  void add_ripple(int axis);
  [[nodiscard]] double seen_by_source(int axis) const;
  [[nodiscard]] Eigen::Vector2d place(std::int64_t i, std::int64_t j) const;
  [[nodiscard]] std::size_t index(std::int64_t i, std::int64_t j) const {
    return static_cast<std::size_t>(j * x_.count + i);
  }
  [[nodiscard]] double flux_of(std::size_t a, std::size_t b, std::size_t c) const;

  const PartScene& scene_;
  CellRange cells_;
  Nodes x_, y_;
  std::vector<double> z_, slope_x_, slope_y_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Eigen::Vector2d> landing_;
};

}  // namespace lensforge
