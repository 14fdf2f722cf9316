// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

namespace lensforge {

/// Names of the files in a lens folder (docs/interface.md, "The lens folder").
namespace lens_file {
inline constexpr const char* kJson = "lens.json";
inline constexpr const char* kSurface = "surface.ply";
inline constexpr const char* kSpline = "surface.spline";
/// For a lens with an outline: the mesh that kSurface is cut from.
inline constexpr const char* kSheet = "sheet.ply";
/// For a lens whose front is a height map: its heights.
inline constexpr const char* kFront = "front.exr";
inline constexpr const char* kTargetPng = "target.png";
inline constexpr const char* kTargetExr = "target.exr";
inline constexpr const char* kRenderPng = "render.png";
inline constexpr const char* kRenderExr = "render.exr";
inline constexpr const char* kRenderColor = "render_color.png";  ///< With a spectrum.
inline constexpr const char* kError = "error.png";
inline constexpr const char* kConvergence = "convergence.csv";
inline constexpr const char* kOverview = "overview.png";
inline constexpr const char* kSetup = "setup.svg";
inline constexpr const char* kCheckpoint = "checkpoint.bin";  ///< While a design is unfinished.

/// All of them.
inline constexpr std::array kAll = {kJson,      kSurface,   kSpline,    kSheet,       kFront,
                                    kTargetPng, kTargetExr, kRenderPng, kRenderExr,   kRenderColor,
                                    kError,     kOverview,  kSetup,     kConvergence, kCheckpoint};

/// Temporary folder of old versions, left behind if one was killed.
inline constexpr const char* kStaging = "lens";

/// The subfolder that `cam` writes into, and its files other than the programs.
inline constexpr const char* kCut = "cam";
inline constexpr std::array kCutFiles = {"report.html", "report.json", "compare.html",
                                         "milled.ply",  "milled.png",  "leakage.png"};
}  // namespace lens_file

}  // namespace lensforge
