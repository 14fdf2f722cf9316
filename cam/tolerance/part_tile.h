// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "cam/milled/lens_grid.h"
#include "cam/tolerance/base_heights.h"
#include "cam/tolerance/error_heights.h"
#include "cam/tolerance/line_filter.h"
#include "cam/tolerance/part_light.h"
#include "cam/tool/polish_model.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {

/// What every tile of one part is rendered with.
struct PartScene {
  const BaseHeights& base;
  const ErrorHeights& heights;
  const PartLight& light;
  const PolishModel& polish;
  std::array<LineFilter, 2> filter;  ///< Along x and y.
  Eigen::Vector2d lens_size;         ///< mm
  std::int64_t margin = 0;           ///< Pixels around the picture.
};

/// A rectangle of cells of one part: its heights with errors are polished, its nodes' rays are
/// landed, and two triangles a cell are deposited.
class PartTile {
 public:
  PartTile(const PartScene& scene, const CellRange& cells);

  void deposit(const FluxAccumulator& image) const;

 private:
  void polish();
  void take_off_rim();
  void land();
  void sharpen();
  [[nodiscard]] Eigen::Vector2d place(std::int64_t i, std::int64_t j) const;
  [[nodiscard]] double flux_of(std::size_t a, std::size_t b, std::size_t c) const;

  const PartScene& scene_;
  CellRange cells_;
  std::int64_t columns_;  ///< Nodes, with one more on every side than the cells have.
  std::int64_t rows_;
  std::vector<double> z_, slope_x_, slope_y_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Eigen::Vector2d> landing_;
};

}  // namespace lensforge
