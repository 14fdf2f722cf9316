// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/part_model.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "cam/tolerance/error_heights.h"
#include "cam/tolerance/line_filter.h"
#include "cam/tolerance/part_light.h"
#include "cam/tolerance/part_tile.h"
#include "cam/tolerance/ripple.h"
#include "cam/tolerance/source_blur.h"
#include "design/flux/flux_image.h"

namespace lensforge {
namespace {

/// Cells of a tile: its buffers, 1 MB, stay in a core's cache, and an interrupt waits for two.
constexpr std::int64_t kTile = 96;

std::array<BaseAxis, 2> axes_of(const PartPlan& plan) {
  const Eigen::Vector2d& size = plan.optics.lens_size;
  const Eigen::Vector2d detail = size.cwiseQuotient(plan.optics.pixels.cast<double>());
  return base_axes(size, plan.passes, plan.polish.sigma, detail);
}

/// Nodes that the filters of the strongest polish need beyond the rim, one more for the slopes
/// there that errors ask for, and one for the landing places beside the rim's.
std::int64_t pad_of(const std::array<BaseAxis, 2>& axes, double sigma) {
  return std::max(line_filter_reach(sigma, axes[0].spacing),
                  line_filter_reach(sigma, axes[1].spacing)) +
         2;
}

double mean_height(const BaseHeights& base) {
  double sum = 0.0;
  for (std::int64_t j = 0; j < base.axis(1).nodes; ++j) {
    for (std::int64_t i = 0; i < base.axis(0).nodes; ++i) sum += *base.at(i, j);
  }
  return sum / static_cast<double>(base.axis(0).nodes * base.axis(1).nodes);
}

/// Every so many of the base's nodes along an axis, and the last.
std::vector<std::int64_t> coarse_nodes(const BaseAxis& axis) {
  constexpr std::int64_t kCells = 64;
  std::vector<std::int64_t> nodes;
  const std::int64_t cells = axis.nodes - 1;
  const std::int64_t count = std::min(kCells, cells);
  for (std::int64_t k = 0; k <= count; ++k) nodes.push_back(k * cells / count);
  return nodes;
}

/// Through which the light goes that the part takes.
PartNodes light_nodes(const BaseHeights& base) {
  const std::vector<std::int64_t> columns = coarse_nodes(base.axis(0));
  PartNodes nodes{columns.size(), {}};
  for (const std::int64_t j : coarse_nodes(base.axis(1))) {
    for (const std::int64_t i : columns) {
      nodes.places.emplace_back(static_cast<double>(i) * base.axis(0).spacing,
                                static_cast<double>(j) * base.axis(1).spacing, *base.at(i, j));
    }
  }
  return nodes;
}

/// Across rows that leave a ripple there are four nodes a pitch.
SceneAxis scene_axis(const BaseAxis& axis, double sigma, bool ripples) {
  SceneAxis scene;
  scene.ripples = ripples;
  const LinePolish polish{sigma, axis.spacing, axis.box(), 2 * axis.half};
  const std::int64_t reach = line_filter_reach(sigma, axis.spacing);
  for (std::int64_t shift = 0; shift <= (ripples ? 1 : 0); ++shift) {
    scene.filters.push_back(line_filter(polish, shift, reach));
  }
  return scene;
}

/// Where boxes hold several pitches, these are so much finer than σ that no ripple is left: less
/// than 1e-5 of a scallop's slope.
bool ripples(const BaseAxis& axis, const Passes& passes) { return axis.box() < 1.5 * passes.pitch; }

/// With the scene's margin.
FluxRaster render_tiles(const PartScene& scene, const Eigen::Vector2i& pixels,
                        const Executor& executor) {
  FluxRaster raster{pixels.x() + 2 * scene.margin, pixels.y() + 2 * scene.margin, {}};
  FluxImage image(static_cast<int>(raster.columns), static_cast<int>(raster.rows));
  image.begin(executor);
  const std::vector<CellRange> tiles =
      tiles_of({0, 0, scene.base.axis(0).nodes - 1, scene.base.axis(1).nodes - 1}, kTile);
  const auto add_tile = [&](std::int64_t t, const FluxAccumulator& sum) {
    PartTile(scene, tiles[static_cast<std::size_t>(t)]).deposit(sum);
  };
  image.add(executor, static_cast<std::int64_t>(tiles.size()), add_tile, 1);
  const auto flux = image.resolve(executor);
  raster.flux.assign(flux.begin(), flux.end());
  return raster;
}

FluxPicture cropped(const FluxRaster& raster, std::int64_t margin) {
  FluxPicture picture;
  picture.columns = static_cast<int>(raster.columns - 2 * margin);
  picture.rows = static_cast<int>(raster.rows - 2 * margin);
  for (std::int64_t r = margin; r < raster.rows - margin; ++r) {
    const auto row = raster.flux.begin() + r * raster.columns;
    picture.flux.insert(picture.flux.end(), row + margin, row + raster.columns - margin);
  }
  return picture;
}

/// Radii along x and y of the spot that a point of the part lights: that of the source, and, along
/// a ripple of which the source sees less than there is (PartTile), so much more that the variance
/// is that of all of it.
Eigen::Vector2d blur_radii(const PartScene& scene, const Eigen::Vector2d& scale,
                           const Eigen::Vector3d& middle) {
  Eigen::Vector2d square = scene.source.cwiseAbs2();
  const Eigen::Vector2d slope = scene.light.slope_of_middle(middle.z());
  for (int axis = 0; axis < 2; ++axis) {
    if (!scene.axes[static_cast<std::size_t>(axis)].ripples) continue;
    const Eigen::Vector2d moved = scene.light.moved_by(middle, slope, axis);
    const double seen = scene.ripple.seen_by_disc(scene.source[axis] / scale[axis]);
    const double far = scene.ripple.largest() * moved[axis];
    square[axis] += 2.0 * far * far * (1.0 - seen * seen);
  }
  return square.cwiseSqrt();
}

}  // namespace

PartModel::PartModel(const SurfaceField& cut, const SurfaceField& designed, const PartPlan& plan,
                     const Executor& executor, const RunControl& control)
    : plan_(plan),
      base_(BaseHeights::sample(cut, designed, axes_of(plan),
                                pad_of(axes_of(plan), plan.largest_sigma), executor, control)),
      mean_height_(mean_height(base_)),
      lit_(light_nodes(base_)) {}

FluxPicture PartModel::render(const PartError& error, const Executor& executor) const {
  const Passes& passes = plan_.passes;
  const double sigma = std::min(plan_.polish.sigma * error.sigma_factor, plan_.largest_sigma);
  const PartLight light(plan_.optics, error);
  const ErrorHeights heights(base_, error, passes, sigma);
  const Ripple ripple(passes, passes.ball_radius + error.radius, sigma);
  const auto axis = [&](int k) {
    const bool across = k != passes.axis || passes.cross;
    return scene_axis(base_.axis(k), sigma, across && ripples(base_.axis(k), passes));
  };
  PartScene scene{base_,
                  heights,
                  light,
                  ripple,
                  plan_.polish,
                  {axis(0), axis(1)},
                  plan_.optics.lens_size,
                  0,
                  light.whole(lit_),
                  light.source_radii(error.source, mean_height_)};
  if (scene.source.isZero()) return cropped(render_tiles(scene, plan_.optics.pixels, executor), 0);
  const Eigen::Vector2d& size = plan_.optics.lens_size;
  const Eigen::Vector3d middle(0.5 * size.x(), 0.5 * size.y(), mean_height_);
  const Eigen::Vector2d scale = plan_.optics.pixels.cast<double>().cwiseQuotient(size);
  const BlurKernel blur = disc_blur(blur_radii(scene, scale, middle));
  scene.margin = blur.reach;
  const FluxRaster raster = render_tiles(scene, plan_.optics.pixels, executor);
  return cropped(blurred(raster, blur, executor), blur.reach);
}

std::int64_t part_nodes(const PartPlan& plan) {
  const std::array<BaseAxis, 2> axes = axes_of(plan);
  return axes[0].nodes * axes[1].nodes;
}

}  // namespace lensforge
