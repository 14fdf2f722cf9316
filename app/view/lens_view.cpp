// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/lens_view.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <variant>

#include "app/view/cut_folder.h"
#include "core/error.h"
#include "core/io/lens_folder.h"
#include "core/surface/lens.h"
#include "core/surface/mesh_normals.h"
#include "core/surface/optical_surface.h"
#include "design/render_lens.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Nodes of a spline at most: more would not fit a page of 25 MB.
constexpr double kMostNodes = 480e3;
/// Samples of a height map, 4 bytes each in a page.
constexpr std::size_t kMostHeights = 1'000'000;

/// The surface with the normals that send its light: none of facets.
SampledSurface surface_of(const Lens& lens) {
  if (lens.spline) {
    const auto cells = static_cast<double>(lens.spline->cell_count());
    return spline_nodes(*lens.spline, samples_for(kMostNodes, cells));
  }
  if (lens.model == SurfaceModel::kFacet) return {lens.surface, {}};
  return {lens.surface, vertex_area_normals(lens.surface)};
}

/// The picture of a surface as stored against the program's own.
double storage_error(const SampledSurface& stored, const OpticalSetup& setup, const Image& target,
                     const Image& picture, const Executor& executor) {
  Image drawn;
  if (stored.normals.cols() > 0) {
    evaluate(stored.mesh, stored.normals, setup, target, &drawn, executor);
  } else {
    evaluate(stored.mesh, setup, SurfaceModel::kFacet, target, &drawn, executor);
  }
  return compare(drawn, picture).mae;
}

/// @throw InputError if a height map would not fit a page of 25 MB beside the surfaces.
void require_small_front(const OpticalSetup& setup, const std::string& name) {
  const auto* const map = setup.front ? std::get_if<HeightFront>(&*setup.front) : nullptr;
  if (map == nullptr || map->spline->coefficients().size() <= kMostHeights) return;
  throw InputError(name + ": its front has more than " + std::to_string(kMostHeights) +
                   " samples, too many for a page; render draws its picture");
}

/// A surface with the picture that the program has of it.
ViewedSurface viewed(const std::string& id, const std::string& words, const SampledSurface& surface,
                     Image picture, const Lens& lens, const Executor& executor) {
  ViewedSurface result{id, words, {}, std::move(picture), 0.0};
  result.surface = store_surface(surface.mesh, surface.normals, lens.setup.lens_size);
  result.storage_error =
      storage_error(result.surface.read_back, lens.setup, lens.target, result.picture, executor);
  return result;
}

/// Adds the surfaces of a part, and what each cause makes of the picture.
void add_forecast(const fs::path& folder, const Lens& lens, const Executor& executor,
                  const RunControl& control, LensView& view) {
  CutForecast forecast = read_forecast(folder, lens, control);
  if (!forecast.note.empty()) {
    view.notes.push_back((folder / lens_file::kCut).string() + ": " + forecast.note);
  }
  if (forecast.empty()) return;
  view.surfaces.push_back(viewed("polished", "only polished", forecast.polished,
                                 forecast.causes[1].picture, lens, executor));
  view.surfaces.push_back(viewed("part", "cut and polished", forecast.part,
                                 forecast.causes.back().picture, lens, executor));
  for (CausePicture& cause : forecast.causes) {
    view.causes.push_back({std::move(cause.cause), "", std::move(cause.picture)});
  }
  view.causes[2].surface = "polished";
  view.causes.back().surface = "part";
  view.path = std::move(forecast.path);
  view.leakage_map = std::move(forecast.leakage_map);
}

LensRaster relief_of(const Lens& lens) {
  const auto surface = optical_surface(lens, lens.model);
  const Eigen::Vector2d size = lens.setup.lens_size;
  const Eigen::Vector2d nodes = (kReliefNodes - 1) * size / size.maxCoeff();
  LensRaster raster{static_cast<int>(std::lround(nodes.x())) + 1,
                    static_cast<int>(std::lround(nodes.y())) + 1,
                    {}};
  for (int row = 0; row < raster.rows; ++row) {
    for (int column = 0; column < raster.columns; ++column) {
      const Eigen::Vector2d share(column / std::max(1.0, raster.columns - 1.0),
                                  row / std::max(1.0, raster.rows - 1.0));
      const auto point = surface->at(nearest_inside(surface->box(), size.cwiseProduct(share)));
      raster.values.push_back(point ? static_cast<float>(point->z) : 0.0F);
    }
  }
  return raster;
}

}  // namespace

LensView view_of_lens(const Lens& lens, const std::string& name, const Executor& executor) {
  require_small_front(lens.setup, name);
  LensView view;
  view.name = name;
  view.setup = lens.setup;
  view.model = model_name(lens.model);
  view.target = lens.target;
  view.surfaces.push_back(
      viewed("designed", "as designed", surface_of(lens), lens.render, lens, executor));
  view.causes.push_back({"the design", "designed", lens.render});
  view.relief = relief_of(lens);
  return view;
}

LensView read_view(const fs::path& folder, const Executor& executor, const RunControl& control) {
  const Lens lens = read_lens(folder);
  if (lens.render.empty()) {
    throw InputError(folder.string() + ": holds no " + lens_file::kRenderExr +
                     ", the picture that the lens projects; design it again");
  }
  control.report({"picture", 0.0, 0.0, ""});
  LensView view = view_of_lens(lens, fs::weakly_canonical(folder).filename().string(), executor);
  add_forecast(folder, lens, executor, control, view);
  if (control.stop_requested()) throw Interrupted();
  return view;
}

}  // namespace lensforge
