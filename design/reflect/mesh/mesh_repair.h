// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// A mesh that the reflector stage works on, and what was changed to make it one.
struct RepairedMesh {
  SurfaceMesh mesh;
  std::vector<std::string> changes;  ///< In words: "12 duplicate vertices merged".
  std::vector<int> vertex;  ///< What became of every vertex: its number, −1 if it was dropped.
  std::vector<int> face;    ///< What every face was part of: its number in the mesh as it came.
  bool closed = false;
};

/// Merges vertices that stand in the same place, removes faces without area and vertices without a
/// face, and turns faces that disagree with their neighbours; the faces of a closed piece then look
/// outwards.
/// @param name  of the file, for messages.
/// @throw InputError naming the face or edge: no face with an area, an edge with more than two
///        faces, a piece with one side only (a Möbius strip), coordinates so large or small that
///        areas vanish.
RepairedMesh repair_mesh(const SurfaceMesh& mesh, const std::string& name);

}  // namespace lensforge::reflect
