// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/solid/solids_module.h"

#include <sys/stat.h>

#include <array>
#include <ctime>

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Loads the module on the first call. @throw RunError as load_module() does.
const solids_module::Table& table() {
  static const auto& loaded = load_module<solids_module::Table>("solids");
  return loaded;
}

}  // namespace

std::string file_time(const fs::path& file) {
  struct stat about {};
  if (::stat(file.c_str(), &about) != 0) return {};
  std::tm utc{};
  ::gmtime_r(&about.st_mtime, &utc);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &utc)};
}

std::int64_t check_part21(std::string_view content, const std::string& name) {
  return table().check_part21(content, name);
}

SolidContent write_step(const SplineNet& net, const StepHeader& header, StepSchema schema,
                        const fs::path& path, const RunControl& control) {
  return table().write_step(net, header, schema, path, control);
}

SolidContent write_mesh_step(const SurfaceMesh& mesh, const StepHeader& header,
                             const fs::path& path, const RunControl& control) {
  return table().write_mesh_step(mesh, header, path, control);
}

SolidContent inspect_step(const fs::path& path, const RunControl& control) {
  return table().inspect_step(path, control);
}

std::int64_t check_iges(std::string_view content, const std::string& name) {
  return table().check_iges(content, name);
}

SolidContent write_iges(const SplineNet& net, const StepHeader& header, const fs::path& path,
                        const RunControl& control) {
  return table().write_iges(net, header, path, control);
}

SolidContent inspect_iges(const fs::path& path, const RunControl& control) {
  return table().inspect_iges(path, control);
}

SolidSurface read_solid_surface(const fs::path& path, double points, const Executor& executor,
                                const RunControl& control) {
  return table().read_solid_surface(path, points, executor, control);
}

SurfaceMesh read_solid_mesh(const fs::path& path, const RunControl& control) {
  return table().read_solid_mesh(path, control);
}

}  // namespace lensforge
