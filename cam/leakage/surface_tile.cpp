// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/surface_tile.h"

#include <algorithm>
#include <string>

#include "core/error.h"

namespace lensforge {
namespace {

/// Seen along z, as far as light passes, mm².
double area_of(const GridWindow& grid, const std::optional<Outline>& outline) {
  if (outline) return polygon_area(outline->points);
  return grid.spacing.x() * static_cast<double>(grid.columns - 1) * grid.spacing.y() *
         static_cast<double>(grid.rows - 1);
}

}  // namespace

SurfaceTile::SurfaceTile(const OpticalSetup& setup, const GridWindow& grid, double whole)
    : light_(setup),
      outline_(setup.outline ? std::optional<OutlineIndex>(*setup.outline) : std::nullopt),
      grid_(grid) {
  take_light(setup, whole);
}

void SurfaceTile::take_light(const OpticalSetup& setup, double whole) {
  light_ = LightPath(setup);
  lens_area_ = whole > 0.0 ? whole : area_of(grid_, setup.outline);
  triangle_flux_ = 0.5 * grid_.spacing.prod() / lens_area_;
}

void SurfaceTile::load(const SurfaceField& field, const CellRange& range,
                       const Executor& executor) {
  range_ = range;
  halo_columns_ = std::min<std::int64_t>(1, range.column);
  halo_rows_ = std::min<std::int64_t>(1, range.row);
  const GridWindow window = window_of(grid_, range, 1);
  field.sample(window, executor, patch_);
  patch_.window = window;
  const std::int64_t count = window.size();
  LF_CHECK(static_cast<std::int64_t>(patch_.z.size()) == count, std::to_string(patch_.z.size()));
  land(executor);
  if (outline_) find_rim(executor);
}

void SurfaceTile::relight(const OpticalSetup& setup, double whole, const Executor& executor) {
  take_light(setup, whole);
  land(executor);
}

void SurfaceTile::land(const Executor& executor) {
  const std::int64_t count = patch_.window.size();
  landing_.resize(static_cast<std::size_t>(count));
  if (light_.varies()) entries_.resize(static_cast<std::size_t>(count));
  parallel_for(executor, "land nodes", count, [this](std::int64_t i) {
    const auto k = static_cast<std::size_t>(i);
    const Eigen::Vector2d at =
        patch_.window.node(i % patch_.window.columns, i / patch_.window.columns);
    if (light_.varies()) entries_[k] = light_.ray_to({at.x(), at.y(), patch_.z[k]});
    landing_[k] =
        land_of(light_, at, patch_.z[k], {patch_.slope_x[k], patch_.slope_y[k]}, entry(k));
  });
  if (patch_.cut.empty()) sharpen_landing(executor);
}

void SurfaceTile::find_rim(const Executor& executor) {
  sides_.resize(static_cast<std::size_t>(cells()));
  parallel_for(executor, "find rim", cells(), [this](std::int64_t cell) {
    const std::int64_t i = cell % range_.columns;
    const std::int64_t j = cell / range_.columns;
    sides_[static_cast<std::size_t>(cell)] = outline_->side_of({place(i, j), place(i + 1, j + 1)});
  });
}

void SurfaceTile::sharpen_landing(const Executor& executor) {
  const std::int64_t columns = patch_.window.columns;
  const std::int64_t rows = patch_.window.rows;
  sharpened_.resize(landing_.size());
  const auto sharpen_row = [&](std::int64_t j) {
    const bool inner_row = j > 0 && j + 1 < rows;
    for (std::int64_t i = 0; i < columns; ++i) {
      const bool inner_column = i > 0 && i + 1 < columns;
      const auto n = static_cast<std::size_t>(j * columns + i);
      sharpened_[n] = sharp_landing(landing_, n, columns, {inner_column, inner_row});
    }
  };
  parallel_for(executor, "sharpen landing", rows, sharpen_row, 16);
  landing_.swap(sharpened_);
}

/// Derivative of the slope along one axis, from neighbours on the same cut; zero without any, which
/// keeps the node's own beam.
Eigen::Vector2d SurfaceTile::bend_along(std::size_t node, std::int64_t step, bool has_before,
                                        bool has_after) const {
  const auto offset = static_cast<std::size_t>(step);
  const std::int32_t cut = patch_.cut[node];
  const bool before = has_before && patch_.cut[node - offset] == cut;
  const bool after = has_after && patch_.cut[node + offset] == cut;
  const std::size_t low = before ? node - offset : node;
  const std::size_t high = after ? node + offset : node;
  if (low == high) return {0.0, 0.0};
  const double spacing = step == 1 ? grid_.spacing.x() : grid_.spacing.y();
  const double distance = spacing * static_cast<double>(int{before} + int{after});
  return Eigen::Vector2d(patch_.slope_x[high] - patch_.slope_x[low],
                         patch_.slope_y[high] - patch_.slope_y[low]) /
         distance;
}

Eigen::Vector3d SurfaceTile::point(std::size_t node) const {
  const std::int64_t columns = patch_.window.columns;
  const auto index = static_cast<std::int64_t>(node);
  const Eigen::Vector2d at = patch_.window.node(index % columns, index / columns);
  return {at.x(), at.y(), patch_.z[node]};
}

SurfaceSide SurfaceTile::side_of(std::size_t node) const {
  const GridWindow& window = patch_.window;
  const std::int64_t i = static_cast<std::int64_t>(node) % window.columns;
  const std::int64_t j = static_cast<std::int64_t>(node) / window.columns;
  SurfaceSide side;
  side.place = window.node(i, j);
  side.z = patch_.z[node];
  side.slope = {patch_.slope_x[node], patch_.slope_y[node]};
  side.cut = patch_.cut[node];
  const Eigen::Vector2d by_x = bend_along(node, 1, i > 0, i + 1 < window.columns);
  const Eigen::Vector2d by_y = bend_along(node, window.columns, j > 0, j + 1 < window.rows);
  const double twist = 0.5 * (by_x.y() + by_y.x());
  side.bend << by_x.x(), twist, twist, by_y.y();
  return side;
}

}  // namespace lensforge
