// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "core/surface/mesh_builder.h"
#include "core/surface/mesh_readers.h"
#include "core/surface/mesh_text.h"

// Geomview manual, "OFF Files": [ST][C][N][4][n]OFF, then the numbers of vertices, faces and edges,
// then a line for each vertex and each face. 4OFF and nOFF have other than three coordinates.
namespace lensforge {
namespace {

constexpr std::array<std::string_view, 8> kKeywords{"OFF",   "COFF",   "NOFF",   "CNOFF",
                                                    "STOFF", "STCOFF", "STNOFF", "STCNOFF"};

bool is_keyword(std::string_view word) {
  return std::find(kKeywords.begin(), kKeywords.end(), word) != kKeywords.end();
}

/// A number of vertices or faces.
std::int64_t count_from(std::string_view word, const MeshText& text, const std::string& meaning) {
  const std::int64_t count = text.whole_from(word, meaning);
  if (!std::in_range<std::int32_t>(count) || count < 0) {
    text.refuse(meaning + " is " + std::to_string(count) + ": it must be in 0 to 2147483647");
  }
  return count;
}

void need_line(MeshText& text, const std::string& kind, std::int64_t done, std::int64_t count) {
  if (text.next_line()) return;
  text.refuse("is truncated: it holds " + std::to_string(done) + " of " + std::to_string(count) +
              " " + kind);
}

void read_vertices(MeshText& text, std::int64_t count, MeshBuilder& builder) {
  for (std::int64_t v = 0; v < count; ++v) {
    need_line(text, "vertices", v, count);
    const double x = text.number("x of a vertex");
    const double y = text.number("y of a vertex");
    const double z = text.number("z of a vertex");
    builder.add_vertex(x, y, z);
  }
}

void read_faces(MeshText& text, std::int64_t count, MeshBuilder& builder) {
  for (std::int64_t f = 0; f < count; ++f) {
    need_line(text, "faces", f, count);
    const std::int64_t corners = text.whole_from(text.word(), "the number of a face's corners");
    if (corners != 3) text.refuse(corner_problem(f, corners));
    for (int k = 0; k < 3; ++k) {
      const std::int64_t vertex = text.whole_from(text.word(), "a face's corner");
      if (!std::in_range<int>(vertex)) {
        text.refuse("a face uses vertex " + std::to_string(vertex) + ": there is none");
      }
      builder.add_corner(static_cast<int>(vertex));
    }
  }
}

}  // namespace

SurfaceMesh read_off(std::string_view content, const std::string& name) {
  MeshText text(content, name, MeshText::Comments::kHash);
  text.next_line();
  if (const auto keyword = text.word(); !is_keyword(keyword)) {
    text.refuse("begins with " + quoted_word(keyword) + ": an OFF mesh begins with \"OFF\"");
  }
  std::string meaning = "the number of vertices";
  const std::string_view first = text.word_of_any_line(meaning);
  if (first == "BINARY") text.refuse("is binary: save it as text OFF, PLY or STL");
  const std::int64_t vertices = count_from(first, text, meaning);
  meaning = "the number of faces";
  const std::int64_t faces = count_from(text.word_of_any_line(meaning), text, meaning);
  MeshBuilder builder;
  read_vertices(text, vertices, builder);
  read_faces(text, faces, builder);
  return builder.mesh();
}

}  // namespace lensforge
