// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/image/metrics.h"
#include "core/io/lens_folder.h"
#include "core/io/pending_files.h"
#include "core/optics/optical_setup.h"
#include "core/surface/control_net.h"
#include "core/surface/optical_surface.h"
#include "core/surface/sampled_surface.h"
#include "core/surface/surface_mesh.h"
#include "core/surface/surface_model.h"

namespace lensforge {

/// How close the pictures of a surface under each model are to the target.
using ModelMetrics = std::map<SurfaceModel, ImageMetrics>;

/// A designed lens: what one command hands to the next.
struct Lens {
  /// The optical surface, z ≥ thickness; mm, lens frame. It fills the lens's rectangle, also where
  /// setup.outline leaves less to the light.
  SurfaceMesh surface;
  /// That surface itself if the model is a spline; `surface` then has its nodes (kMeshSamples).
  std::optional<ControlNet> spline;
  OpticalSetup setup;
  SurfaceModel model = SurfaceModel::kFacet;  ///< The model it was designed with.
  Image target;                               ///< Working picture, linear light.
  Image render;                               ///< What the lens projects under `model`.
  /// What it projects under each model that it has (models_of()).
  ModelMetrics metrics{{SurfaceModel::kFacet, {}}, {SurfaceModel::kSmooth, {}}};
  /// Under an extended source: of the best picture that any surface could make.
  std::optional<ImageMetrics> source_limit;
  nlohmann::json provenance = nlohmann::json::object();
};

/// The models that a lens's surface can be looked at with: a spline's nodes make a mesh, too.
std::vector<SurfaceModel> models_of(const Lens& lens);

/// The lens's surface under one of them.
std::shared_ptr<const OpticalSurface> optical_surface(const Lens& lens, SurfaceModel model);

/// The optical surface as far as the lens's outline goes, its corners on the outline too, with the
/// normals of the smooth model or the spline: light everywhere on it gives the lens's picture.
SampledSurface lens_part(const Lens& lens, const Executor& executor);

/// Writes a lens into the folder of `files`, behind what these hold already. All are written beside
/// before one is renamed, an older lens.json goes first and the new one comes last: a folder with a
/// lens.json is whole. @throw RunError if something cannot be written.
void write_lens(const Lens& lens, PendingFiles files);

/// The same for a lens alone, without convergence.csv, overview.png and setup.svg of `design`.
void write_lens(const Lens& lens, const std::filesystem::path& folder);

/// Reads a lens folder back.
/// @throw InputError naming the folder or file and the field if something is missing, of another
///        version, of another type, or contradicts itself.
Lens read_lens(const std::filesystem::path& folder);

}  // namespace lensforge
