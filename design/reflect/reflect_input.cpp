// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/reflect_input.h"

#include <algorithm>
#include <charconv>
#include <sstream>

#include "core/error.h"
#include "core/io/files.h"
#include "design/reflect/light/light_field.h"
#include "design/reflect/mesh/mesh_repair.h"
#include "design/reflect/mesh/mirror.h"
#include "design/reflect/mesh/remesh.h"
#include "design/reflect/radar/cross_section.h"
#include "design/reflect/radar/radar_comparison.h"

namespace lensforge::reflect {
namespace {

/// Largest file of numbers that is read.
constexpr std::uintmax_t kMaxListBytes = std::uintmax_t{64} << 20U;

/// Whole numbers below `limit`, a group for every line that has some.
std::vector<std::vector<int>> number_groups(const std::string& option, const std::string& file,
                                            std::int64_t limit) {
  std::vector<std::vector<int>> groups;
  std::istringstream lines(read_whole_file(file, kMaxListBytes));
  for (std::string line; std::getline(lines, line);) {
    std::vector<int> group;
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      int number = -1;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
      const bool whole = error == std::errc() && end == word.data() + word.size();
      if (!whole || number < 0 || number >= limit) {
        throw InputError(option + " " + file + ": " + word +
                         " is no number of the mesh: must be 0 to " + std::to_string(limit - 1));
      }
      group.push_back(number);
    }
    if (!group.empty()) groups.push_back(group);
  }
  if (groups.empty())
    throw InputError(option + " " + file + ": must name one number at least, as 0");
  return groups;
}

void fix_box(const ReflectOptions& options, ReflectInput& input) {
  const Eigen::VectorXd box = number_list("--fix-box", options.fix_box, 6);
  const Eigen::Vector3d low = box.head<3>().cwiseMin(box.tail<3>());
  const Eigen::Vector3d high = box.head<3>().cwiseMax(box.tail<3>());
  for (Eigen::Index v = 0; v < input.mesh.vertex_count(); ++v) {
    const Eigen::Array3d p = input.mesh.vertices.col(v);
    if ((p >= low.array()).all() && (p <= high.array()).all()) {
      input.fixed[static_cast<std::size_t>(v)] = 1;
    }
  }
}

void fix_plane(const ReflectOptions& options, ReflectInput& input) {
  const Eigen::VectorXd plane = number_list("--fix-plane", options.fix_plane, 4);
  const Eigen::Vector3d normal = plane.head<3>();
  if (!(normal.norm() > 0.0)) {
    throw InputError("--fix-plane " + options.fix_plane +
                     ": its normal must not be 0,0,0; 0,0,1,0 holds all at or below z = 0");
  }
  for (Eigen::Index v = 0; v < input.mesh.vertex_count(); ++v) {
    if (normal.dot(input.mesh.vertices.col(v)) <= plane[3]) {
      input.fixed[static_cast<std::size_t>(v)] = 1;
    }
  }
}

void require_movable(const ReflectInput& input) {
  const bool movable = std::find(input.fixed.begin(), input.fixed.end(), 0) != input.fixed.end();
  if (movable) return;
  throw InputError("--fix-box, --fix-plane and --fix-vertices hold all " +
                   std::to_string(input.mesh.vertex_count()) +
                   " vertices: one at least must be free to move; name a smaller part");
}

void find_fixed(const ReflectOptions& options, const RepairedMesh& repaired, ReflectInput& input) {
  const bool any =
      !options.fix_box.empty() || !options.fix_plane.empty() || !options.fix_vertices.empty();
  if (!any) return;
  input.fixed.assign(static_cast<std::size_t>(input.mesh.vertex_count()), 0);
  if (!options.fix_box.empty()) fix_box(options, input);
  if (!options.fix_plane.empty()) fix_plane(options, input);
  if (!options.fix_vertices.empty()) {
    const auto limit = static_cast<std::int64_t>(repaired.vertex.size());
    for (const auto& group : number_groups("--fix-vertices", options.fix_vertices, limit)) {
      for (const int v : group) {
        const int number = repaired.vertex[static_cast<std::size_t>(v)];
        if (number >= 0) input.fixed[static_cast<std::size_t>(number)] = 1;
      }
    }
  }
  require_movable(input);
}

void require_closed(const ReflectOptions& options, const std::string& name, bool closed) {
  if (closed) return;
  const char* option = options.keep_volume           ? "--keep-volume"
                       : options.min_thickness > 0.0 ? "--min-thickness"
                                                     : nullptr;
  if (option == nullptr) return;
  throw InputError(std::string(option) + ": " + name +
                   " is open: must be a closed mesh; --keep-box takes an open one");
}

void require_no_numbers(const ReflectOptions& options) {
  if (options.faces == 0) return;
  for (const auto& [option, file] : {std::pair("--fix-vertices", options.fix_vertices),
                                     std::pair("--planar-faces", options.planar_faces)}) {
    if (file.empty()) continue;
    throw InputError(std::string(option) + " " + file +
                     ": --faces makes another mesh, with other numbers; leave one of them out");
  }
}

/// The groups of --planar-faces. Faces without area are in none any more, and halves of a face are
/// in its group.
std::vector<std::vector<int>> planar_groups(const ReflectOptions& options, std::int64_t faces,
                                            const RepairedMesh& repaired) {
  std::vector<std::vector<int>> parts(static_cast<std::size_t>(faces));
  for (std::size_t f = 0; f < repaired.face.size(); ++f) {
    parts[static_cast<std::size_t>(repaired.face[f])].push_back(static_cast<int>(f));
  }
  std::vector<std::vector<int>> planar;
  for (const auto& group : number_groups("--planar-faces", options.planar_faces, faces)) {
    std::vector<int> now;
    for (const int f : group) {
      const std::vector<int>& of_face = parts[static_cast<std::size_t>(f)];
      now.insert(now.end(), of_face.begin(), of_face.end());
    }
    if (!now.empty()) planar.push_back(now);
  }
  return planar;
}

}  // namespace

ReflectInput prepared_input(const SurfaceMesh& mesh, const std::string& name,
                            const ReflectOptions& options) {
  require_no_numbers(options);
  const RepairedMesh repaired = repair_mesh(mesh, name);
  ReflectInput input{repaired.mesh, repaired.closed, repaired.changes, {}, {}, {}};
  require_closed(options, name, input.closed);
  if (options.faces > 0) {
    input.mesh = remeshed(repaired.mesh, options.faces);
    input.changes.push_back("remeshed from " + std::to_string(repaired.mesh.triangle_count()) +
                            " to " + std::to_string(input.mesh.triangle_count()) + " faces");
  }
  if (options.radar_ghz > 0.0) {
    require_radar_size(input.mesh, radar_wavelength(options.radar_ghz));
  }
  find_fixed(options, repaired, input);
  if (!options.planar_faces.empty()) {
    input.planar = planar_groups(options, mesh.triangle_count(), repaired);
  }
  if (options.symmetry != Symmetry::kNone) {
    input.partner = mirror_partners(input.mesh, static_cast<int>(options.symmetry));
  }
  return input;
}

}  // namespace lensforge::reflect
