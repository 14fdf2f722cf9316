// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/mesh/surface_mesh.h"
#include "design/reflect/reflect_options.h"

namespace lensforge::reflect {

/// A mesh that is ready to be deformed, with the parts that are to stay as they are.
struct ReflectInput {
  SurfaceMesh mesh;
  bool closed = false;
  std::vector<std::string> changes;      ///< What was repaired, in words.
  std::vector<std::uint8_t> fixed;       ///< One flag per vertex; empty: all move.
  std::vector<std::vector<int>> planar;  ///< Groups of faces, each of which stays in one plane.
  std::vector<int> partner;              ///< Mirror image of every vertex; empty: no symmetry.
};

/// Repairs a mesh, remeshes it for --faces, and finds what the options hold fast.
/// @param name  of its file, for messages.
/// @throw InputError naming file or option: what cannot be repaired, an open mesh where a volume or
///        a thickness is to be kept, numbers of vertices or faces that it does not have, no vertex
///        left that may move, options that contradict each other.
ReflectInput prepared_input(const SurfaceMesh& mesh, const std::string& name,
                            const ReflectOptions& options);

}  // namespace lensforge::reflect
