// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/part_layers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace lensforge {
namespace {

/// Quotients that are whole but for this must not cost a cell.
constexpr double kRounding = 1e-9;

/// Nodes of one tile that are kept.
void keep_nodes(const SurfacePatch& patch, const PartGrid& grid, const std::string& name,
                const Executor& executor, LayeredImage& layers) {
  const std::array values{&patch.z, &patch.slope_x, &patch.slope_y};
  const std::array names{".z", ".slope_x", ".slope_y"};
  const GridWindow& window = patch.window;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto layer = layers.layer(name + names[k]);
    const auto keep_row = [&](std::int64_t j) {
      const std::int64_t row = window.first_row + j;
      if (row % grid.every.y() != 0) return;
      const std::int64_t from_top = grid.nodes.y() - 1 - row / grid.every.y();
      for (std::int64_t i = 0; i < window.columns; ++i) {
        const std::int64_t column = window.first_column + i;
        if (column % grid.every.x() != 0) continue;
        const std::int64_t at = from_top * grid.nodes.x() + column / grid.every.x();
        layer[static_cast<std::size_t>(at)] =
            static_cast<float>((*values[k])[static_cast<std::size_t>(j * window.columns + i)]);
      }
    };
    parallel_for(executor, "keep surface", window.rows, keep_row, 16);
  }
}

std::vector<std::string> layer_names(const std::vector<NamedSurface>& surfaces) {
  std::vector<std::string> names;
  for (const NamedSurface& surface : surfaces) {
    for (const char* layer : {".z", ".slope_x", ".slope_y"}) names.push_back(surface.name + layer);
  }
  return names;
}

}  // namespace

PartGrid part_grid(const Eigen::Vector2d& lens_size, const Eigen::Vector2d& spacings, double most) {
  const double coarse = std::sqrt(lens_size.prod() / most);
  PartGrid grid;
  for (int axis = 0; axis < 2; ++axis) {
    // A spacing that is a part of the pitch should stay one: as many cells as it asks for, if their
    // number allows that.
    const double cells = std::ceil(lens_size[axis] / spacings[axis] - kRounding);
    const double every = std::max(1.0, std::ceil(coarse / spacings[axis] - kRounding));
    grid.every[axis] = static_cast<int>(every);
    grid.nodes[axis] = static_cast<int>(std::max(1.0, std::ceil(cells / every))) + 1;
  }
  return grid;
}

GridWindow sampled_grid(const Eigen::Vector2d& lens_size, const Eigen::Vector2d& spacings) {
  const PartGrid nodes = part_grid(lens_size, spacings, kPartNodes);
  const Eigen::Array2i cells = (nodes.nodes.array() - 1) * nodes.every.array();
  GridWindow grid;
  grid.spacing = lens_size.cwiseQuotient(cells.cast<double>().matrix());
  grid.columns = cells.x() + 1;
  grid.rows = cells.y() + 1;
  return grid;
}

PartLayers::PartLayers(std::vector<NamedSurface> surfaces, const Eigen::Vector2d& lens_size,
                       const Eigen::Vector2d& spacings)
    : surfaces_(std::move(surfaces)),
      nodes_(part_grid(lens_size, spacings, kPartNodes)),
      layers_(nodes_.nodes.x(), nodes_.nodes.y(), layer_names(surfaces_)) {}

void PartLayers::take(const SurfaceField& field, const SurfacePatch& tile,
                      const Executor& executor) {
  for (const NamedSurface& surface : surfaces_) {
    if (surface.field == &field) keep_nodes(tile, nodes_, surface.name, executor, layers_);
  }
}

LayeredImage cause_layers(const LeakageResult& leakage, double total) {
  std::vector<const RenderedSurface*> surfaces{&leakage.designed};
  for (const RenderedSurface& step : leakage.steps) surfaces.push_back(&step);
  std::vector<std::string> names;
  for (const RenderedSurface* surface : surfaces) names.push_back(surface->name);
  const FluxPicture& part = leakage.part().picture;
  LayeredImage layers(part.columns, part.rows, names);
  for (const RenderedSurface* surface : surfaces) {
    const Image image = surface->picture.image(total);
    std::copy(image.values().begin(), image.values().end(), layers.layer(surface->name).begin());
  }
  return layers;
}

}  // namespace lensforge
