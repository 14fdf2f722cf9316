// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/sandbox/module.h"
#include "export/solid/solid_files.h"
#include "export/solid/solid_reading.h"

/// The module "solids": all code that calls OpenCASCADE. The functions of the same names in
/// solid_files.h and solid_reading.h have the contracts.
namespace lensforge::solids_module {

std::int64_t check_part21(std::string_view content, const std::string& name);
SolidContent write_step(const SplineNet& net, const StepHeader& header, StepSchema schema,
                        const std::filesystem::path& path, const RunControl& control);
SolidContent write_mesh_step(const SurfaceMesh& mesh, const StepHeader& header,
                             const std::filesystem::path& path, const RunControl& control);
SolidContent inspect_step(const std::filesystem::path& path, const RunControl& control);

std::int64_t check_iges(std::string_view content, const std::string& name);
SolidContent write_iges(const SplineNet& net, const StepHeader& header,
                        const std::filesystem::path& path, const RunControl& control);
SolidContent inspect_iges(const std::filesystem::path& path, const RunControl& control);

SolidSurface read_solid_surface(const std::filesystem::path& path, double points,
                                const Executor& executor, const RunControl& control);
SurfaceMesh read_solid_mesh(const std::filesystem::path& path, const RunControl& control);

struct Table {
  ModuleHead head;
  decltype(&solids_module::check_part21) check_part21;
  decltype(&solids_module::write_step) write_step;
  decltype(&solids_module::write_mesh_step) write_mesh_step;
  decltype(&solids_module::inspect_step) inspect_step;
  decltype(&solids_module::check_iges) check_iges;
  decltype(&solids_module::write_iges) write_iges;
  decltype(&solids_module::inspect_iges) inspect_iges;
  decltype(&solids_module::read_solid_surface) read_solid_surface;
  decltype(&solids_module::read_solid_mesh) read_solid_mesh;
};

}  // namespace lensforge::solids_module
