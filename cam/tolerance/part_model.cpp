// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/part_model.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "cam/tolerance/error_heights.h"
#include "cam/tolerance/line_filter.h"
#include "cam/tolerance/part_light.h"
#include "cam/tolerance/part_tile.h"
#include "cam/tolerance/picture_blur.h"
#include "cam/tolerance/ripple.h"
#include "design/flux/flux_image.h"

namespace lensforge {
namespace {

/// Cells of a tile: its buffers, 1 MB, stay in a core's cache, and an interrupt waits for two.
constexpr std::int64_t kTile = 96;

std::array<BaseAxis, 2> axes_of(const PartPlan& plan) {
  return base_axes(plan.optics.lens_size, plan.passes, plan.polish.sigma);
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

LineFilter filter_of(const BaseAxis& axis, double sigma) {
  return line_filter({sigma, axis.spacing, axis.box(), 2 * axis.half},
                     line_filter_reach(sigma, axis.spacing));
}

/// What blurs a part's picture.
struct Blurs {
  std::array<bool, 2> lines{false, false};  ///< Along the picture's x and y.
  std::array<BlurKernel, 2> line;
  BlurKernel disc;

  [[nodiscard]] std::int64_t reach() const {
    return std::max(line[0].reach, line[1].reach) + disc.reach;
  }
};

Blurs blurs_of(const PartPlan& plan, const PartError& error, const PartLight& light, double sigma,
               double z) {
  const Passes& passes = plan.passes;
  Blurs blurs;
  const std::vector<WeightedValue> slopes = ripple_slopes(
      passes, passes.ball_radius + error.radius, error.eccentricity, {sigma, error.sigma_within});
  for (int axis = 0; axis < 2; ++axis) {
    if (axis == passes.axis && !passes.cross) continue;
    std::vector<WeightedValue> distances = slopes;
    for (WeightedValue& d : distances) {
      d.value = std::copysign(light.reach(std::abs(d.value), z)[axis], d.value);
    }
    blurs.lines[static_cast<std::size_t>(axis)] = true;
    blurs.line[static_cast<std::size_t>(axis)] = line_blur(distances);
  }
  if (error.source > 0.0) blurs.disc = disc_blur(light.source_radius(error.source, z));
  return blurs;
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

}  // namespace

PartModel::PartModel(const SurfaceField& cut, const SurfaceField& designed, const PartPlan& plan,
                     const Executor& executor, const RunControl& control)
    : plan_(plan),
      base_(BaseHeights::sample(cut, designed, axes_of(plan),
                                pad_of(axes_of(plan), plan.largest_sigma), executor, control)),
      mean_height_(mean_height(base_)) {}

FluxPicture PartModel::render(const PartError& error, const Executor& executor) const {
  const double sigma = std::min(plan_.polish.sigma * error.sigma_factor, plan_.largest_sigma);
  const PartLight light(plan_.optics, error);
  const ErrorHeights heights(base_, error, plan_.passes, sigma);
  const Blurs blurs = blurs_of(plan_, error, light, sigma, mean_height_);
  const std::int64_t margin = blurs.reach();
  const PartScene scene{base_,
                        heights,
                        light,
                        plan_.polish,
                        {filter_of(base_.axis(0), sigma), filter_of(base_.axis(1), sigma)},
                        plan_.optics.lens_size,
                        margin};
  const Eigen::Vector2i pixels = plan_.optics.pixels;
  FluxRaster raster{pixels.x() + 2 * margin, pixels.y() + 2 * margin, {}};
  FluxImage image(static_cast<int>(raster.columns), static_cast<int>(raster.rows));
  image.begin(executor);
  const std::vector<CellRange> tiles =
      tiles_of({0, 0, base_.axis(0).nodes - 1, base_.axis(1).nodes - 1}, kTile);
  const auto add_tile = [&](std::int64_t t, const FluxAccumulator& sum) {
    PartTile(scene, tiles[static_cast<std::size_t>(t)]).deposit(sum);
  };
  image.add(executor, static_cast<std::int64_t>(tiles.size()), add_tile, 1);
  const auto flux = image.resolve(executor);
  raster.flux.assign(flux.begin(), flux.end());
  for (int axis = 0; axis < 2; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    if (blurs.lines[k]) raster = blurred_along(raster, axis, blurs.line[k], executor);
  }
  if (error.source > 0.0) raster = blurred(raster, blurs.disc, executor);
  return cropped(raster, margin);
}

std::int64_t part_nodes(const PartPlan& plan) {
  const std::array<BaseAxis, 2> axes = axes_of(plan);
  return axes[0].nodes * axes[1].nodes;
}

}  // namespace lensforge
