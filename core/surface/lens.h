// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "core/image/image.h"
#include "core/image/metrics.h"
#include "core/optics/optical_setup.h"
#include "core/surface/control_net.h"
#include "core/surface/optical_surface.h"
#include "core/surface/surface_mesh.h"
#include "core/surface/surface_model.h"

namespace lensforge {

/// How close the pictures of a surface under each model are to the target.
using ModelMetrics = std::map<SurfaceModel, ImageMetrics>;

/// A designed lens: what one command hands to the next.
struct Lens {
  SurfaceMesh surface;  ///< The optical surface, z ≥ thickness; mm, lens frame.
  /// That surface itself if the model is a spline; `surface` then has its nodes (kMeshSamples).
  std::optional<ControlNet> spline;
  OpticalSetup setup;
  SurfaceModel model = SurfaceModel::kFacet;  ///< The model it was designed with.
  Image target;                               ///< Working picture, linear light.
  Image render;                               ///< What the lens projects under `model`.
  /// What it projects under each model that it has (models_of()).
  ModelMetrics metrics{{SurfaceModel::kFacet, {}}, {SurfaceModel::kSmooth, {}}};
  nlohmann::json provenance = nlohmann::json::object();
};

/// The models that a lens's surface can be looked at with: a spline's nodes make a mesh, too.
std::vector<SurfaceModel> models_of(const Lens& lens);

/// The lens's surface under one of them.
std::shared_ptr<const OpticalSurface> optical_surface(const Lens& lens, SurfaceModel model);

/// Names of the files in a lens folder (docs/interface.md, "The lens folder").
namespace lens_file {
inline constexpr const char* kJson = "lens.json";
inline constexpr const char* kSurface = "surface.ply";
inline constexpr const char* kSpline = "surface.spline";
inline constexpr const char* kTargetPng = "target.png";
inline constexpr const char* kTargetExr = "target.exr";
inline constexpr const char* kRenderPng = "render.png";
inline constexpr const char* kRenderExr = "render.exr";
inline constexpr const char* kError = "error.png";
inline constexpr const char* kConvergence = "convergence.csv";
inline constexpr const char* kOverview = "overview.png";
inline constexpr const char* kCheckpoint = "checkpoint.bin";  ///< While a design is unfinished.

/// All of them.
inline constexpr std::array kAll = {kJson,      kSurface,     kSpline,    kTargetPng,
                                    kTargetExr, kRenderPng,   kRenderExr, kError,
                                    kOverview,  kConvergence, kCheckpoint};

/// Folder in which earlier versions put a lens together; a killed one has left it behind.
inline constexpr const char* kStaging = "lens";

/// The folder inside that `cam` writes into, and what is in it beside the programs.
inline constexpr const char* kCut = "cam";
inline constexpr std::array kCutFiles = {"report.html", "report.json", "compare.html",
                                         "milled.ply",  "milled.png",  "leakage.png"};
}  // namespace lens_file

/// Writes every file of the lens folder but convergence.csv; each is written beside and renamed,
/// and lens.json comes last, so that a folder with a lens.json is always whole.
/// @throw RunError if something cannot be written.
void write_lens(const Lens& lens, const std::filesystem::path& folder);

/// Reads a lens folder back.
/// @throw InputError naming the folder or file and the field if something is missing, of another
///        version, of another type, or contradicts itself.
Lens read_lens(const std::filesystem::path& folder);

}  // namespace lensforge
