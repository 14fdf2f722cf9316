// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/render_field.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/optics/optical_setup.h"
#include "design/flux/flux_image.h"
#include "design/waves/wave_picture.h"

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

OpticalSetup FieldRenderSetup::optics_in_parts(const SourceKernel& kernel) const {
  OpticalSetup fine = optics;
  fine.pixels *= kernel.parts;
  return fine;
}

namespace {

/// Adds the picture of a loaded tile in light of every colour.
void add_colors(SurfaceTile& tile, const FieldRenderSetup& setup,
                const std::vector<LightColor>& colors, const Executor& executor, FluxImage& image) {
  for (std::size_t color = 0; color < colors.size(); ++color) {
    const double share = colors[color].share;
    if (colors.size() > 1) tile.relight(colors[color].setup, setup.whole_in(color), executor);
    image.add(executor, tile.cells(), [&](std::int64_t cell, const FluxAccumulator& sum) {
      tile.visit_cell(cell, [&](ImageTriangle piece) {
        piece.flux *= share;
        deposit(piece, sum);
      });
    });
  }
}

std::vector<FluxPicture> render_parts(std::span<const SurfaceField* const> fields,
                                      const FieldRenderSetup& setup, const CellRange& cells,
                                      const Executor& executor, const RunControl& control,
                                      const TileObserver& observe = {}) {
  const Eigen::Vector2i pixels = setup.optics.pixels;
  const SourceKernel kernel = setup.blur();
  const OpticalSetup optics = setup.optics_in_parts(kernel);
  SourceBlurOn<Executor> blur(kernel, pixels.x(), pixels.y(), executor);
  std::vector<FluxImage> images;
  for (std::size_t f = 0; f < fields.size(); ++f) {
    images.emplace_back(optics.pixels.x(), optics.pixels.y()).begin(executor);
  }
  const std::vector<LightColor> colors = light_colors(optics);
  SurfaceTile tile(colors.front().setup, setup.grid, setup.whole_in(0));
  const std::vector<CellRange> tiles = tiles_of(cells, setup.tile);
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    for (std::size_t f = 0; f < fields.size(); ++f) {
      if (control.stop_requested()) throw Interrupted();
      tile.load(*fields[f], tiles[t], executor);
      if (observe) observe(*fields[f], tiles[t], tile.patch());
      add_colors(tile, setup, colors, executor, images[f]);
    }
    control.report({"render surfaces", static_cast<double>(t + 1),
                    static_cast<double>(tiles.size()), "tiles"});
  }
  std::vector<FluxPicture> pictures;
  for (FluxImage& image : images) {
    const std::span<const double> flux = blur.apply(executor, image.resolve(executor));
    pictures.push_back({pixels.x(), pixels.y(), {flux.begin(), flux.end()}});
  }
  return pictures;
}

}  // namespace

std::vector<FluxPicture> render_fields(std::span<const SurfaceField* const> fields,
                                       const FieldRenderSetup& setup, const Executor& executor,
                                       const RunControl& control, const TileObserver& observe) {
  return render_parts(fields, setup, all_cells(setup.grid), executor, control, observe);
}

FluxPicture render_field(const SurfaceField& field, const FieldRenderSetup& setup,
                         const Executor& executor, const RunControl& control) {
  return render_cells(field, setup, all_cells(setup.grid), executor, control);
}

FluxPicture render_cells(const SurfaceField& field, const FieldRenderSetup& setup,
                         const CellRange& cells, const Executor& executor,
                         const RunControl& control) {
  const SurfaceField* const one = &field;
  return std::move(render_parts({&one, 1}, setup, cells, executor, control).front());
}

FluxPicture light_of_cells(const SurfaceField& field, const FieldRenderSetup& setup,
                           const CellRange& cells, const std::optional<WaveOptions>& waves,
                           const Executor& executor, const RunControl& control) {
  if (!waves) return render_cells(field, setup, cells, executor, control);
  const Eigen::Vector2i& pixels = setup.optics.pixels;
  return {pixels.x(), pixels.y(),
          wave_flux_of({setup.grid, cells, setup.whole}, setup.optics, field, *waves, executor,
                       control)};
}

}  // namespace lensforge
