// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "cam/leakage/leakage.h"
#include "cam/milled/surface_field.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"
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

/// Heights, mm, and slopes of surfaces as layers "NAME.z", "NAME.slope_x" and "NAME.slope_y", at
/// nodes evenly over the lens, the upper left one first. Every node has what the surface, sampled
/// at `spacings`, has there. @throw Interrupted
LayeredImage surface_layers(const std::vector<NamedSurface>& surfaces,
                            const Eigen::Vector2d& lens_size, const Eigen::Vector2d& spacings,
                            const Executor& executor, const RunControl& control);

/// The pictures of the designed surface and of a chain's steps, under the names that they have
/// there, linear light.
/// @param total  of a picture with all of the lens's light.
LayeredImage cause_layers(const LeakageResult& leakage, double total);

}  // namespace lensforge
