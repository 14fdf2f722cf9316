// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "cam/leakage/leakage.h"
#include "cam/milled/surface_field.h"
#include "core/image/layered_image.h"

namespace lensforge {

/// Surfaces in part.exr.
namespace part_layer {
inline constexpr const char* kPolished = "polished";  ///< As designed, but polished.
inline constexpr const char* kPart = "part";          ///< Cut and polished.
}  // namespace part_layer

/// Nodes of a surface in part.exr, about: what a page of 25 MB can hold.
inline constexpr double kPartNodes = 4e5;

/// The nodes of a surface's layers: columns and rows, evenly over the lens, and how many cells of
/// the grid that is sampled lie between two of them.
struct PartGrid {
  Eigen::Vector2i nodes;
  Eigen::Vector2i every;
};

/// @param spacings  of the grid that is sampled, along x and y, at most, mm. @param most  nodes,
/// about.
PartGrid part_grid(const Eigen::Vector2d& lens_size, const Eigen::Vector2d& spacings, double most);

/// The grid over the lens that is sampled, at most `spacings` apart: nodes of part_grid() with
/// kPartNodes are nodes of it.
GridWindow sampled_grid(const Eigen::Vector2d& lens_size, const Eigen::Vector2d& spacings);

/// Heights, mm, and slopes of surfaces as layers "NAME.z", "NAME.slope_x" and "NAME.slope_y", at
/// nodes evenly over the lens, the upper left one first, kept from the tiles that are sampled for
/// the surfaces' pictures.
class PartLayers {
 public:
  /// @param spacings  as of sampled_grid(), whose tiles are taken.
  PartLayers(std::vector<NamedSurface> surfaces, const Eigen::Vector2d& lens_size,
             const Eigen::Vector2d& spacings);

  /// Keeps what layers need of a surface's tile; of other surfaces that is nothing.
  void take(const SurfaceField& field, const SurfacePatch& tile, const Executor& executor);

  /// @pre every tile was taken.
  [[nodiscard]] const LayeredImage& layers() const { return layers_; }

 private:
  std::vector<NamedSurface> surfaces_;
  PartGrid nodes_;
  LayeredImage layers_;
};

/// The pictures of the designed surface and of a chain's steps, under the names that they have
/// there, linear light.
/// @param total  of a picture with all of the lens's light.
LayeredImage cause_layers(const LeakageResult& leakage, double total);

}  // namespace lensforge
