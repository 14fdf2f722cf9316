// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/render_field.h"

#include <cstddef>
#include <optional>
#include <span>
#include <utility>

#include "cam/leakage/surface_tile.h"
#include "core/error.h"
#include "core/optics/optical_setup.h"
#include "design/flux/flux_image.h"
#include "design/waves/wave_picture.h"

namespace lensforge {

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
