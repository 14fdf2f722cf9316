// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

namespace lensforge::lens_file {

/// Files that `cam` writes beside kCutFiles, for a page that draws the part: its surfaces, and the
/// picture with each cause of misdirected light.
inline constexpr const char* kPartSurfaces = "part.exr";
inline constexpr const char* kCausePictures = "causes.exr";
inline constexpr std::array kCutLayers = {kPartSurfaces, kCausePictures};

}  // namespace lensforge::lens_file
