// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/prediction.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "cam/leakage/render_field.h"
#include "cam/milled/surface_field.h"
#include "cam/part_layers.h"
#include "core/error.h"
#include "core/optics/light_colors.h"
#include "core/optics/light_path.h"
#include "core/surface/lit_surface.h"
#include "core/surface/mesh_cut.h"

namespace lensforge {
namespace {

/// Side of the cells in which leaking light is looked for, mm: a groove of a few of them is what an
/// operator can find again.
constexpr double kLeakCell = 1.0;

/// Nodes along the longer side of the surface that the report shows.
constexpr double kViewNodes = 240.0;

constexpr double kMicrometres = 1e3;

/// A whole surface, coarsely.
SurfacePatch coarse_patch(const SurfaceField& field, const Lens& lens, double spacing,
                          const Executor& executor) {
  SurfacePatch patch;
  field.sample(lens_grid(lens.setup.lens_size, spacing), executor, patch);
  return patch;
}

/// LightPath::intake() of all of the lens inside of its outline, mm².
double lit_intake(const Lens& lens, const LightPath& light, const Executor& executor) {
  const std::optional<Outline>& outline = lens.setup.outline;
  if (!outline) return intake_of(lens.surface, light);
  return intake_inside(lens.surface, cut_mesh(lens.surface, *outline, executor), light);
}

LensRaster raster_of(const SurfacePatch& patch) {
  LensRaster raster;
  raster.columns = static_cast<int>(patch.window.columns);
  raster.rows = static_cast<int>(patch.window.rows);
  raster.values.assign(patch.z.begin(), patch.z.end());
  return raster;
}

/// Of the cells of a leak map.
ReportMap height_map(const LeakMap& map) {
  ReportMap heights{"Height",
                    "Polished part against the design, the largest difference in every square; "
                    "below 0 too much is taken off.",
                    "µm",
                    {static_cast<int>(map.columns), static_cast<int>(map.rows), {}}};
  for (const HeightDifference& difference : map.height) {
    heights.raster.values.push_back(static_cast<float>(kMicrometres * difference.value));
  }
  return heights;
}

}  // namespace

Prediction predict_part(const PartSurfaces& surfaces, const Lens& lens, const CamOptions& options,
                        const Executor& executor, const RunControl& control) {
  Prediction result;
  LeakageChain chain = surfaces.chain();
  const Eigen::Vector2d spacings = sample_spacings(options, lens.setup);
  const GridWindow grid = sampled_grid(lens.setup.lens_size, spacings);
  PartLayers layers(
      {{part_layer::kPolished, chain.steps.front().field}, {part_layer::kPart, &surfaces.part()}},
      lens.setup.lens_size, spacings);
  FieldRenderSetup setup{lens.setup, grid};
  setup.surface_height = lens.surface.vertices.row(2).mean();
  for (const LightColor& color : light_colors(lens.setup)) {
    const LightPath light(color.setup);
    if (!light.intake_is_plan_area()) setup.whole.push_back(lit_intake(lens, light, executor));
  }
  for (NamedSurface& other : chain.others) {
    if (other.name != surface_name::kMilled) continue;
    other.grid = lens_grid(lens.setup.lens_size, scallop_spacings(options, lens.setup));
  }
  CreaseMapper creases(grid, {});
  const auto keep = [&](const SurfaceField& field, const CellRange& tile,
                        const SurfacePatch& patch) {
    layers.take(field, patch, executor);
    if (&field == &surfaces.rounded()) creases.add(tile, patch, executor);
  };
  result.leakage =
      measure_leakage(chain, lens.target, setup, options.leakage, executor, control, keep);
  result.sampling = check_sampling(surfaces.designed(), surfaces.part(), result.leakage,
                                   lens.target, setup, executor, control);
  const std::vector<double> weights =
      pixels_with_surplus(result.leakage.part().picture, result.leakage.designed.picture);
  const LeakMap map =
      map_leakage(chain.designed, chain.part(), setup, weights, kLeakCell, executor);
  result.places = worst_places(map, chain, result.leakage, setup, {}, executor);
  result.creases = creases.map();
  result.height = height_map(map);
  const double spacing = lens.setup.lens_size.maxCoeff() / kViewNodes;
  result.surface = raster_of(coarse_patch(surfaces.milled(), lens, spacing, executor));
  result.milled = mesh_of(coarse_patch(surfaces.milled(), lens, kMeshSpacing, executor));
  result.surfaces = layers.layers();
  return result;
}

}  // namespace lensforge
