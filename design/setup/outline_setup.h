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

/// Share of the lens's rectangle that an outline covers at least: below it nearly the whole mesh
/// would lie in the dark.
inline constexpr double kLeastOutlineShare = 0.05;

/// Pixels of the longer side of an SVG file, as its outline is followed.
inline constexpr int kOutlineDrawing = 2048;

/// Largest distance of a simplified outline from the line that it was drawn with, pixels.
inline constexpr double kOutlineTolerance = 0.1;

/// The edge between the light and the dark parts of a picture as one closed polygon: where its
/// display-encoded values, linear between the pixels' middles, pass one half; outside of the
/// picture is dark. Simplified by Douglas and Peucker's method, within kOutlineTolerance.
/// @return corners in pixels, y upwards. @throw InputError naming `what` if nothing is light, or
///         the light has holes or several pieces.
std::vector<Eigen::Vector2d> contour_of(const Image& picture, const std::string& what);

/// An outline that was asked for, and in plain words what was changed of its picture.
struct OutlineChoice {
  std::optional<Outline> outline;
  std::vector<std::string> changes;
};

/// What `--outline` asks for: rectangle (none), circle, rounded:R, or the name of a picture or
/// an SVG file whose white is lens, as seen against the light, from +z.
/// @param background  what shows through where the picture is transparent.
/// @throw InputError naming option, value and rule; Interrupted.
OutlineChoice outline_from(const std::string& text, const Background& background,
                           const RunControl& control);

/// An outline of DesignOptions in a lens of this size. @pre require_outline() passed.
Outline fitted(const Outline& outline, const Eigen::Vector2d& lens_size);

/// @throw InputError naming option, value and rule if an outline does not fit a lens of this size.
void require_outline(const std::optional<Outline>& outline, const Eigen::Vector2d& lens_size);

}  // namespace lensforge
