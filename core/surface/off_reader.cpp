// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/surface/mesh_builder.h"
#include "core/surface/mesh_readers.h"
#include "core/surface/mesh_text.h"

// Geomview manual, "OFF Files": [ST][C][N][4][n]OFF, which may be left out, then the numbers of
// vertices, faces and edges, then a line for each vertex and each face. 4OFF and nOFF do not have
// three coordinates.
namespace lensforge {
namespace {

constexpr std::array<std::string_view, 8> kKeywords{"off",   "coff",   "noff",   "cnoff",
                                                    "stoff", "stcoff", "stnoff", "stcnoff"};

bool is_keyword(std::string_view word) {
  return std::any_of(kKeywords.begin(), kKeywords.end(),
                     [&](std::string_view keyword) { return same_word(word, keyword); });
}

bool is_number(std::string_view word) {
  return word.find_first_not_of("0123456789") == std::string_view::npos;
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

int read_corner(MeshText& text) {
  const std::int64_t vertex = text.whole_from(text.word(), "a face's corner");
  if (!std::in_range<int>(vertex)) {
    text.refuse("a face uses vertex " + std::to_string(vertex) + ": there is none");
  }
  return static_cast<int>(vertex);
}

void read_faces(MeshText& text, std::int64_t count, MeshBuilder& builder) {
  std::vector<int> corners;
  for (std::int64_t f = 0; f < count; ++f) {
    need_line(text, "faces", f, count);
    const std::int64_t size = text.whole_from(text.word(), "the number of a face's corners");
    if (size < 3) text.refuse(corner_problem(f, size));
    corners.clear();
    for (std::int64_t k = 0; k < size; ++k) corners.push_back(read_corner(text));
    builder.add_face(corners);
  }
}

/// Skips the number of edges, which is not needed and may be missing or on a separate line.
void pass_edges(MeshText& text) {
  if (!text.word().empty()) return;
  MeshText ahead = text;
  if (ahead.next_line() && !ahead.word().empty() && ahead.word().empty()) text = ahead;
}

}  // namespace

SurfaceMesh read_off(std::string_view content, const std::string& name) {
  MeshText text(content, name, MeshText::Form::kHashComments);
  std::string meaning = "the number of vertices";
  std::string_view first = text.word_of_any_line(meaning);
  if (is_keyword(first)) {
    first = text.word_of_any_line(meaning);
  } else if (!is_number(first)) {
    text.refuse("begins with " + quoted_word(first) + ": an OFF mesh begins with \"OFF\"");
  }
  if (same_word(first, "binary")) text.refuse("is binary: save it as text OFF, PLY or STL");
  const std::int64_t vertices = count_from(first, text, meaning);
  meaning = "the number of faces";
  const std::int64_t faces = count_from(text.word_of_any_line(meaning), text, meaning);
  pass_edges(text);
  MeshBuilder builder;
  read_vertices(text, vertices, builder);
  read_faces(text, faces, builder);
  return builder.mesh();
}

}  // namespace lensforge
