// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/text/option_field.h"
#include "export/spline_net.h"
#include "export/step_file.h"

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

}  // namespace lensforge
