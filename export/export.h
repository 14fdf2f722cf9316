// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "core/compute/executor.h"
#include "core/compute/work_estimate.h"
#include "core/image/image.h"
#include "core/lens/lens.h"
#include "core/lens/optical_surface.h"
#include "core/schema/description.h"
#include "export/solid/solid_files.h"
#include "export/spline/spline_fit.h"

namespace lensforge {

class Description;

/// Word of a file format, as for --format: "step" and "iges" are solids of splines, "exr" and "png"
/// height maps, those of mesh_formats() closed meshes.
using ExportFormat = std::string;

/// The format that the file's extension names.
inline constexpr const char* kByExtension = "extension";

/// Options for writing a lens as a file for other programs.
struct ExportOptions {
  bool force = false;  ///< Replace a file that lensforge did not write.
  ExportFormat format = kByExtension;
  int pixels = 1024;  ///< Longer side of a height map.
  // Solids of splines only.
  double tolerance = FitOptions{}.tolerance;                ///< mm
  double normal_tolerance = FitOptions{}.normal_tolerance;  ///< rad
  std::int64_t max_points = 0;                              ///< FitOptions::max_control_points
  StepSchema schema = StepSchema::kAp214;
  std::string author;  ///< In the file's header, at most 200 bytes of printable ASCII.
};

/// Every option of an export.
void describe(Description& d, ExportOptions& o);

bool is_height_map(const ExportFormat& format);
bool is_spline_solid(const ExportFormat& format);

/// The format that the options or the file's extension ask for. @throw InputError if neither does.
ExportFormat export_format(const ExportOptions& options, const std::filesystem::path& out);

/// @throw InputError if an option breaks its rule, `out` is a folder, or holds what may not be
///        replaced.
void validate(const ExportOptions& options, const std::filesystem::path& out);

/// Estimated cost of a height map with `pixels` pixels, as grey PNG or as EXR.
WorkEstimate height_map_work(double pixels, bool grey);

/// Estimated cost of a solid of splines with `control_points` control points.
WorkEstimate spline_solid_work(double control_points);

/// Input of an export.
struct ExportSource {
  Lens lens;                   ///< The lens with the surface to export.
  std::filesystem::path file;  ///< The file it was read from.
};

/// Surface of a lens folder to export.
enum class ExportSurface {
  kDesigned,
  kMilled,  ///< The surface that the cutter leaves.
};

/// Reads a lens folder with the requested surface.
/// @throw InputError as read_lens() does, or if the surface is no height field.
ExportSource read_export_source(const std::filesystem::path& folder, ExportSurface surface);

/// Fit of splines to a mesh.
struct SplineFit {
  FitOptions options;
  NormalBound bound;  ///< Error that no surface can go below.
};

/// A written solid of splines.
struct SplineSolid {
  SplineNet net;
  std::optional<SplineFit> fit;  ///< Empty for a lens that is a spline itself.
  ImageMetrics picture;          ///< Metrics of the splines' projected picture.
  SolidContent content;
  double mesh_volume = 0.0;  ///< Volume under the facets, mm³.
};

/// A written closed mesh.
struct MeshSolid {
  std::int64_t triangles = 0;
  double volume = 0.0;  ///< mm³
};

/// Heights that stand for black and white in a grey picture.
struct GreyScale {
  double black = 0.0;  ///< mm
  double white = 0.0;  ///< mm
};

/// A written height map.
struct HeightMap {
  GridShape pixels;
  double pixel = 0.0;              ///< Pixel width, mm.
  std::optional<GreyScale> scale;  ///< Grey pictures only.
};

/// Result of an export; one of `splines`, `mesh` and `heights` is set.
struct ExportResult {
  ExportFormat format;
  ModelMetrics metrics;  ///< Metrics of the mesh's projected pictures.
  std::optional<SplineSolid> splines;
  std::optional<MeshSolid> mesh;
  std::optional<HeightMap> heights;

  /// False if a solid of splines exceeds its tolerances anywhere.
  [[nodiscard]] bool within_tolerance() const {
    return !splines || !splines->fit || holds(splines->net.error(), splines->fit->options);
  }
};

/// Callbacks of an export; either may be empty.
struct ExportHooks {
  std::function<void(const WorkEstimate&)> announce;  ///< Cost of a large export, before it begins.
  std::function<void()> begin_writing;                ///< Called just before the file is written.
};

/// Writes the surface of a lens as a solid, a closed mesh or a height map, whole or not at all. A
/// solid's header has the surface's own time and hash; the same lens gives the same bytes.
/// @throw InputError if an option breaks its rule, the surface has no outline for the format, or
///        memory or disk space is too small (the message states a value that fits); RunError;
///        Interrupted.
ExportResult export_lens(const ExportSource& source, const std::filesystem::path& out,
                         const ExportOptions& options, const Executor& executor,
                         const RunControl& control = {}, const ExportHooks& hooks = {});

/// Columns and rows of a height map over a rectangle.
GridShape height_map_shape(const Eigen::Vector2d& size, int longer_side);

/// Heights in mm on a raster that covers the surface's rectangle, sampled at the pixel centres,
/// seen from +z with y upwards (row 0 is the farthest). 0 where there is no surface.
/// @param longer_side  pixels on the longer side; the shorter side follows from the rectangle.
/// @throw Interrupted.
Image height_map(const OpticalSurface& surface, int longer_side, const Executor& executor,
                 const RunControl& control = {});

/// Writes a height map as 16-bit grey PNG, linear between the lowest and the highest value, as
/// laser and relief programs read it; whole or not at all.
/// @throw RunError if it cannot be written; Interrupted.
GreyScale write_grey_relief(const Image& heights, const std::filesystem::path& path,
                            const Executor& executor = Executor::serial(),
                            const RunControl& control = {});

}  // namespace lensforge
