// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/compute/work_estimate.h"
#include "core/image/metrics.h"
#include "core/surface/lens.h"
#include "core/text/option_field.h"
#include "export/files/height_map.h"
#include "export/solid/step_file.h"
#include "export/spline/spline_fit.h"

namespace lensforge {

/// What a lens can be written as.
enum class ExportFormat { kByExtension, kStep, kIges, kStl, kObj, kPly, k3mf, kGlb, kExr, kPng };

/// How a lens is written as a file for other programs.
struct ExportOptions {
  bool force = false;  ///< Replace a file that lensforge did not write.
  ExportFormat format = ExportFormat::kByExtension;
  int pixels = 1024;  ///< Longer side of a height map.
  // Of solids of splines.
  double tolerance = FitOptions{}.tolerance;                ///< mm
  double normal_tolerance = FitOptions{}.normal_tolerance;  ///< rad
  std::int64_t max_points = 0;                              ///< FitOptions::max_control_points
  StepSchema schema = StepSchema::kAp214;
  std::string author;  ///< In the file's header, at most 200 bytes of printable ASCII.
};

/// Every option of an export.
const OptionTable<ExportOptions>& export_fields();

/// "step", "iges", "stl", "obj", "ply", "3mf", "glb", "exr" or "png".
std::string word_of(ExportFormat format);

bool is_height_map(ExportFormat format);
bool is_spline_solid(ExportFormat format);

/// The format that the options or the file's extension ask for. @throw InputError if neither does.
ExportFormat export_format(const ExportOptions& options, const std::filesystem::path& out);

/// @throw InputError if an option breaks its rule, `out` is a folder, or holds what may not be
///        replaced.
void validate(const ExportOptions& options, const std::filesystem::path& out);

/// What a height map of so many pixels takes, as grey PNG or as EXR.
WorkEstimate height_map_work(double pixels, bool grey);

/// What a solid of splines with so many control points takes.
WorkEstimate spline_solid_work(double control_points);

/// What is exported.
struct ExportSource {
  Lens lens;                   ///< Its surface is the one to export.
  std::filesystem::path file;  ///< That it was read from.
};

/// Which surface of a lens folder is exported.
enum class ExportSurface {
  kDesigned,
  kMilled,  ///< What the cutter leaves.
};

/// Reads a lens folder with the surface that is wanted.
/// @throw InputError as read_lens() does, or if the surface is no height field.
ExportSource read_export_source(const std::filesystem::path& folder, ExportSurface surface);

/// How a mesh's splines were found.
struct SplineFit {
  FitOptions options;
  NormalBound bound;  ///< What no surface can do better.
};

/// A solid of splines as it was written.
struct SplineSolid {
  SplineNet net;
  std::optional<SplineFit> fit;  ///< Nothing of a lens that is a spline itself.
  ImageMetrics picture;          ///< That the splines project.
  SolidContent content;
  double mesh_volume = 0.0;  ///< Of the facets, mm³.
};

/// A closed mesh as it was written.
struct MeshSolid {
  std::int64_t triangles = 0;
  double volume = 0.0;  ///< mm³
};

/// A height map as it was written.
struct HeightMap {
  GridShape pixels;
  double pixel = 0.0;              ///< Width of one, mm.
  std::optional<GreyScale> scale;  ///< Of a grey picture.
};

/// What was written; one of the last three.
struct ExportResult {
  ExportFormat format = ExportFormat::kByExtension;
  ModelMetrics metrics;  ///< Of the pictures that the mesh projects.
  std::optional<SplineSolid> splines;
  std::optional<MeshSolid> mesh;
  std::optional<HeightMap> heights;

  /// Whether a solid of splines holds its tolerances everywhere; true of all else.
  [[nodiscard]] bool within_tolerance() const {
    return !splines || !splines->fit || holds(splines->net.error(), splines->fit->options);
  }
};

/// Whom an export tells what it is about to do; either may be empty.
struct ExportHooks {
  std::function<void(const WorkEstimate&)> announce;  ///< What a large one takes, before it begins.
  std::function<void()> begin_writing;                ///< The file is being written from here on.
};

/// Writes the surface of a lens as a solid, a closed mesh or a height map, whole or not at all. A
/// solid's header has the surface's own time and hash: the same lens gives the same bytes.
/// @throw InputError if an option breaks its rule, the surface has no outline for the format, or
///        memory and disk have no room, with the value that would fit; RunError; Interrupted.
ExportResult export_lens(const ExportSource& source, const std::filesystem::path& out,
                         const ExportOptions& options, const Executor& executor,
                         const RunControl& control = {}, const ExportHooks& hooks = {});

}  // namespace lensforge
