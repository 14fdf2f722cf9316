// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "core/image/image.h"
#include "core/lens/lens.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// SVG element that shows how to set up the part: lamp, part, screen and viewer from the side (y
/// up) and from above (x up), z to the right in both, with the positions in words. It is to scale
/// unless the part would be too small to see; then everything keeps its true direction from the
/// middle of the part, distant objects are drawn nearer, and the drawing says so.
/// @param part_height  height of the part above z = 0, mm.
std::string light_drawing(const OpticalSetup& setup, double part_height);

/// The same as a separate file.
std::string light_drawing_file(const OpticalSetup& setup, double part_height);

/// One line of a plot.
struct PlotCurve {
  std::string name;
  std::vector<Eigen::Vector2d> points;  ///< Time in s, ascending, and value.
};

/// SVG plot of decreasing values over time, on a logarithmic scale of whole decades. Empty for
/// fewer than two points in all.
/// @param label  text alternative.
std::string decade_plot(const std::vector<PlotCurve>& curves, std::string_view label);

/// Overview picture: the target, pictures of its size, and the surface side by side, each in the
/// orientation of the target. The surface is a relief lit from the upper left, without its broad
/// curvature and with stretched contrast, which shows creases too shallow to see otherwise.
Image draw_overview(const Lens& lens, const std::vector<Image>& pictures);

}  // namespace lensforge
