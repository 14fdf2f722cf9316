// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/render_field.h"

#include <algorithm>
#include <numeric>
#include <span>

#include "cam/leakage/surface_tile.h"
#include "core/error.h"
#include "design/flux/flux_image.h"

namespace lensforge {

double FluxPicture::inside() const { return std::accumulate(flux.begin(), flux.end(), 0.0); }

Image FluxPicture::image(double total) const {
  Image image(columns, rows);
  std::transform(flux.begin(), flux.end(), image.values().begin(),
                 [total](double share) { return static_cast<float>(share * total); });
  return image;
}

FluxPicture render_field(const SurfaceField& field, const FieldRenderSetup& setup,
                         const Executor& executor, const RunControl& control) {
  return render_cells(field, setup, all_cells(setup.grid), executor, control);
}

FluxPicture render_cells(const SurfaceField& field, const FieldRenderSetup& setup,
                         const CellRange& cells, const Executor& executor,
                         const RunControl& control) {
  const Eigen::Vector2i pixels = setup.optics.pixels;
  FluxImage image(pixels.x(), pixels.y());
  image.begin(executor);
  SurfaceTile tile(setup.optics, setup.grid);
  const std::vector<CellRange> tiles = tiles_of(cells, setup.tile);
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    if (control.stop_requested()) throw Interrupted();
    tile.load(field, tiles[t], executor);
    image.add(executor, tile.cells(), [&tile](std::int64_t cell, const FluxAccumulator& sum) {
      tile.visit_cell(cell, [&sum](const ImageTriangle& piece) { deposit(piece, sum); });
    });
    control.report({"render", static_cast<double>(t + 1), static_cast<double>(tiles.size()), ""});
  }
  const std::span<const double> flux = image.resolve(executor);
  return {pixels.x(), pixels.y(), {flux.begin(), flux.end()}};
}

}  // namespace lensforge
