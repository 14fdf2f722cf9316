// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/optical_surface.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "core/spline/control_net.h"

namespace lensforge {

class PendingFiles;

/// Metrics of a surface's picture under each model, against the target.
using ModelMetrics = std::map<SurfaceModel, ImageMetrics>;

/// Metrics as lens.json has them; psnr is null where it is infinite.
nlohmann::ordered_json metrics_json(const ImageMetrics& metrics);
/// An object with the metrics of every model.
nlohmann::ordered_json metrics_json(const ModelMetrics& metrics);

/// The origin of a lens: a JSON object with program, options, time and result.
class Provenance {
 public:
  Provenance();
  Provenance(nlohmann::json object);  // NOLINT: a lens's provenance is assigned as JSON.
  [[nodiscard]] const nlohmann::json& json() const { return *object_; }

 private:
  std::shared_ptr<const nlohmann::json> object_;
};

/// What a lens projects on its second screen.
struct SecondPicture {
  Image target;
  Image render;  ///< Predicted picture under the lens's model; may be empty.
  ImageMetrics metrics;
};

/// A designed lens, passed from command to command.
struct Lens {
  /// The optical surface, z ≥ thickness; mm, lens frame. It fills the lens's rectangle even if
  /// setup.outline is smaller.
  SurfaceMesh surface;
  /// The surface itself if the model is a spline; `surface` then holds its nodes (kMeshSamples).
  std::optional<ControlNet> spline;
  OpticalSetup setup;
  SurfaceModel model = SurfaceModel::kFacet;  ///< The model it was designed with.
  Image target;                               ///< Working picture, linear light.
  Image render;                               ///< Predicted picture under `model`.
  /// Metrics under each of its models (models_of()).
  ModelMetrics metrics{{SurfaceModel::kFacet, {}}, {SurfaceModel::kSmooth, {}}};
  /// With an extended source: metrics of the best picture that any surface could make.
  std::optional<ImageMetrics> source_limit;
  std::optional<SecondPicture> second;  ///< Where setup.second is.
  Provenance provenance;
};

/// The lens's metrics by model, with "source_limit" if its source has an extent.
nlohmann::ordered_json metrics_json(const Lens& lens);

/// The models under which a lens's surface can be evaluated; a spline's nodes also form a mesh.
std::vector<SurfaceModel> models_of(const Lens& lens);

/// The lens's surface under one of them.
std::shared_ptr<const OpticalSurface> optical_surface(const Lens& lens, SurfaceModel model);

/// The optical surface inside the lens's outline, with corners on the outline and the normals of
/// the smooth model or the spline. Light over all of it gives the lens's picture.
SampledSurface lens_part(const Lens& lens, const Executor& executor);

/// Writes a lens into the folder of `files`, after the files already added. All files are written
/// before any is renamed; an old lens.json is removed first and the new one comes last, so a folder
/// with a lens.json is complete. @throw RunError if something cannot be written.
void write_lens(const Lens& lens, PendingFiles files);

/// The same for the lens alone, without convergence.csv, overview.png and setup.svg of `design`.
void write_lens(const Lens& lens, const std::filesystem::path& folder);

/// Reads a lens folder back.
/// @throw InputError naming the folder or file and the field if something is missing, of another
///        version, of another type, or contradicts itself.
Lens read_lens(const std::filesystem::path& folder);

}  // namespace lensforge
