// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/surface_field.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/spline/control_net.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

constexpr double kFinestSpacing = 1e-4;
constexpr double kLargestSide = 1000.0;

void check(const Eigen::Vector2d& size, double spacing) {
  const bool fits = size.minCoeff() > 0.0 && size.maxCoeff() <= kLargestSide;
  if (!fits) {
    throw InputError("lens size is " + std::to_string(size.x()) + " x " + std::to_string(size.y()) +
                     " mm: both sides must be above 0 and at most 1000");
  }
  if (!(spacing >= kFinestSpacing) || !std::isfinite(spacing)) {
    throw InputError("spacing of the rendered surface is " + std::to_string(spacing) +
                     " mm: must be at least 0.0001");
  }
}

}  // namespace

GridWindow lens_grid(const Eigen::Vector2d& size, double spacing) {
  return lens_grid(size, Eigen::Vector2d::Constant(spacing));
}

GridWindow lens_grid(const Eigen::Vector2d& size, const Eigen::Vector2d& spacing) {
  check(size, spacing.x());
  check(size, spacing.y());
  const auto cells = [](double side, double step) {
    return std::max<std::int64_t>(1, std::llround(std::ceil(side / step * (1.0 - 1e-12))));
  };
  const auto spacing_of = [](double side, std::int64_t nodes) {
    const auto count = static_cast<double>(nodes - 1);
    const double even = side / count;
    return even * count > side ? std::nextafter(even, 0.0) : even;
  };
  GridWindow grid;
  grid.columns = cells(size.x(), spacing.x()) + 1;
  grid.rows = cells(size.y(), spacing.y()) + 1;
  grid.spacing = {spacing_of(size.x(), grid.columns), spacing_of(size.y(), grid.rows)};
  return grid;
}

GridWindow window_of(const GridWindow& grid, const CellRange& range, std::int64_t halo) {
  GridWindow window = grid;
  const std::int64_t column = std::max<std::int64_t>(0, range.column - halo);
  const std::int64_t row = std::max<std::int64_t>(0, range.row - halo);
  window.first_column = grid.first_column + column;
  window.first_row = grid.first_row + row;
  window.columns = std::min(grid.columns, range.column + range.columns + 1 + halo) - column;
  window.rows = std::min(grid.rows, range.row + range.rows + 1 + halo) - row;
  return window;
}

CellRange all_cells(const GridWindow& grid) { return {0, 0, grid.columns - 1, grid.rows - 1}; }

std::vector<CellRange> tiles_of(const CellRange& range, const CellCounts& sides) {
  LF_CHECK(sides.minCoeff() > 0, std::to_string(sides.minCoeff()));
  std::vector<CellRange> tiles;
  for (std::int64_t row = 0; row < range.rows; row += sides.y()) {
    for (std::int64_t column = 0; column < range.columns; column += sides.x()) {
      tiles.push_back({range.column + column, range.row + row,
                       std::min(sides.x(), range.columns - column),
                       std::min(sides.y(), range.rows - row)});
    }
  }
  return tiles;
}

std::vector<CellRange> tiles_of(const CellRange& range, std::int64_t side) {
  return tiles_of(range, CellCounts(side, side));
}

namespace {

bool same_grid(const GridWindow& a, const GridWindow& b) {
  return a.origin == b.origin && a.spacing == b.spacing;
}

bool contains(const GridWindow& all, const GridWindow& part) {
  return part.first_column >= all.first_column && part.first_row >= all.first_row &&
         part.first_column + part.columns <= all.first_column + all.columns &&
         part.first_row + part.rows <= all.first_row + all.rows;
}

/// Copies the part of a patch's values that lies in a window.
template <class Value>
void copy_part(const GridWindow& all, const std::vector<Value>& from, const GridWindow& part,
               const Executor& executor, std::vector<Value>& to) {
  to.resize(from.empty() ? 0 : static_cast<std::size_t>(part.size()));
  if (to.empty()) return;
  const std::int64_t column = part.first_column - all.first_column;
  const std::int64_t row = part.first_row - all.first_row;
  const auto copy_row = [&](std::int64_t j) {
    const auto begin = from.begin() + (row + j) * all.columns + column;
    std::copy(begin, begin + part.columns, to.begin() + j * part.columns);
  };
  parallel_for(executor, "held surface", part.rows, copy_row, 16);
}

}  // namespace

void HeldField::sample(const GridWindow& window, const Executor& executor,
                       SurfacePatch& patch) const {
  const GridWindow& all = held_.window;
  if (!same_grid(all, window) || !contains(all, window)) {
    held_.window = {};  // Until the sample is complete.
    field_.sample(window, executor, held_);
    held_.window = window;
  }
  patch.window = window;
  copy_part(all, held_.z, window, executor, patch.z);
  copy_part(all, held_.slope_x, window, executor, patch.slope_x);
  copy_part(all, held_.slope_y, window, executor, patch.slope_y);
  copy_part(all, held_.cut, window, executor, patch.cut);
  copy_part(all, held_.depth, window, executor, patch.depth);
  copy_part(all, held_.width, window, executor, patch.width);
}

namespace {

/// Finds the parameters of one node after another: each search begins where the last one ended.
class SplineRow {
 public:
  /// @param start  parameters near the first node.
  SplineRow(const ControlNet& net, const Eigen::Vector2d& start) : net_(net), uv_(start) {}

  [[nodiscard]] SurfacePoint at(const Eigen::Vector2d& xy) {
    uv_ = net_.parameters_of(xy, uv_);
    const SurfaceShape shape = net_.at(uv_).shape();
    return {shape.z, shape.slope};
  }

 private:
  const ControlNet& net_;
  Eigen::Vector2d uv_;
};

}  // namespace

void OpticalField::sample(const GridWindow& window, const Executor& executor,
                          SurfacePatch& patch) const {
  resize_patch(window, false, patch);
  const auto* const spline = dynamic_cast<const SplineSurface*>(&surface_);
  const auto fill_row = [&](std::int64_t j, const auto& point_at) {
    for (std::int64_t i = 0; i < window.columns; ++i) {
      const auto n = static_cast<std::size_t>(j * window.columns + i);
      const SurfacePoint point = point_at(nearest_inside(surface_.box(), window.node(i, j)));
      patch.z[n] = point.z;
      patch.slope_x[n] = point.slope.x();
      patch.slope_y[n] = point.slope.y();
    }
  };
  const auto sample_row = [&](std::int64_t j) {
    if (spline != nullptr) {
      // Where the first node is if knots are even.
      const Eigen::AlignedBox2d& box = surface_.box();
      const Eigen::Vector2d share = nearest_inside(box, window.node(0, j)).cwiseQuotient(box.max());
      SplineRow row(spline->net(), share.cwiseProduct(spline->net().cells().cast<double>()));
      return fill_row(j, [&](const Eigen::Vector2d& xy) { return row.at(xy); });
    }
    fill_row(j, [&](const Eigen::Vector2d& xy) {
      if (const auto point = surface_.at(xy)) return *point;
      throw InputError("surface: nothing at x " + decimal_text(xy.x(), 3) + " y " +
                       decimal_text(xy.y(), 3) + " mm; it must cover the whole lens");
    });
  };
  parallel_for(executor, "surface", window.rows, sample_row, 4);
}

SurfaceMesh mesh_of(const SurfacePatch& patch) {
  const GridWindow& window = patch.window;
  SurfaceMesh mesh;
  mesh.grid = {static_cast<int>(window.columns), static_cast<int>(window.rows)};
  mesh.vertices.resize(3, window.size());
  for (std::int64_t n = 0; n < window.size(); ++n) {
    mesh.vertices.col(n) << window.node(n % window.columns, n / window.columns),
        patch.z[static_cast<std::size_t>(n)];
  }
  mesh.triangles = grid_triangles(mesh.grid);
  return mesh;
}

}  // namespace lensforge
