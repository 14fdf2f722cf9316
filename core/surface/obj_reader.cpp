// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/surface/mesh_builder.h"
#include "core/surface/mesh_readers.h"
#include "core/surface/mesh_text.h"

// Wavefront, "Object Files (.obj)", version 3.0: indices count from 1, negative ones from the last
// vertex back. Lines that do not belong to the mesh (normals, groups, materials, …) are ignored,
// and so are values after z: a weight, or a colour.
namespace lensforge {
namespace {

void read_vertex(MeshText& text, MeshBuilder& builder) {
  const double x = text.number("x of a vertex");
  const double y = text.number("y of a vertex");
  const double z = text.number("z of a vertex");
  builder.add_vertex(x, y, z);
}

/// The vertex of "7", "7/2", "7//3" or "7/2/3", counted from 0.
int corner_of(std::string_view word, const MeshText& text, const MeshBuilder& builder) {
  const std::int64_t index = text.whole_from(word.substr(0, word.find('/')), "a face's corner");
  const std::int64_t vertex = index > 0 ? index - 1 : builder.vertex_count() + index;
  if (index == 0 || vertex < 0 || !std::in_range<int>(vertex)) {
    text.refuse("a face uses vertex " + std::to_string(index) +
                ": vertices count from 1 on, or from -1 back");
  }
  return static_cast<int>(vertex);
}

void read_face(MeshText& text, MeshBuilder& builder) {
  std::vector<int> corners;
  for (auto word = text.word(); !word.empty(); word = text.word()) {
    corners.push_back(corner_of(word, text, builder));
  }
  if (corners.size() < 3) text.refuse(corner_problem(builder.face_count(), std::ssize(corners)));
  builder.add_face(corners);
}

}  // namespace

SurfaceMesh read_obj(std::string_view content, const std::string& name) {
  MeshText text(content, name, MeshText::Form::kContinuedLines);
  MeshBuilder builder;
  while (text.next_line()) {
    const std::string_view keyword = text.word();
    if (same_word(keyword, "v")) read_vertex(text, builder);
    // "fo" is the keyword for faces before version 3.0.
    if (same_word(keyword, "f") || same_word(keyword, "fo")) read_face(text, builder);
  }
  return builder.mesh();
}

}  // namespace lensforge
