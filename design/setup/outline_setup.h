// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/optics/outline.h"
#include "design/setup/design_options.h"

namespace lensforge {

/// Minimum share of the lens's rectangle that an outline covers: below it nearly the whole mesh is
/// dark.
inline constexpr double kLeastOutlineShare = 0.05;

/// Pixels of the longer side at which an SVG file is drawn to find its outline.
inline constexpr int kOutlineDrawing = 2048;

/// Maximum distance of a simplified outline from the original, pixels.
inline constexpr double kOutlineTolerance = 0.1;

/// The edge between the light and the dark part of a picture as one closed polygon: the line where
/// its display-encoded values, interpolated linearly between the pixels' centres, pass one half.
/// Outside of the picture is dark. Simplified by Douglas and Peucker's method, within
/// kOutlineTolerance.
/// @return corners in pixels, y upwards. @throw InputError naming `what` if nothing is light, or
///         the light has holes or several pieces.
std::vector<Eigen::Vector2d> contour_of(const Image& picture, const std::string& what);

/// The requested outline, and the changes made to its picture, in plain words.
struct OutlineChoice {
  std::optional<Outline> outline;
  std::vector<std::string> changes;
};

/// Reads `--outline`: rectangle (none), circle, rounded:R, or the name of a picture or SVG file in
/// which the lens is white, seen from +z.
/// @param background  shown where the picture is transparent.
/// @throw InputError naming option, value and rule; Interrupted.
OutlineChoice outline_from(const std::string& text, const Background& background,
                           const RunControl& control);

/// Fits an outline of DesignOptions into a lens of this size. @pre require_outline() passed.
Outline fitted(const Outline& outline, const Eigen::Vector2d& lens_size);

/// @throw InputError naming option, value and rule if an outline does not fit a lens of this size.
void require_outline(const std::optional<Outline>& outline, const Eigen::Vector2d& lens_size);

}  // namespace lensforge
