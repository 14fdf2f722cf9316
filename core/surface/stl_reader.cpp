// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <unordered_map>

#include "core/error.h"
#include "core/surface/mesh_builder.h"
#include "core/surface/mesh_readers.h"
#include "core/surface/mesh_text.h"

// Binary: 80 arbitrary bytes, a count, then 50 bytes per triangle (normal, three corners, two
// arbitrary bytes). Text: solid { facet normal n { outer loop { vertex v } endloop } endfacet }
// endsolid, with any white space between words. A binary file may begin with "solid" too, so its
// size decides; if the size does not match, a zero byte, which text never contains.
namespace lensforge {
namespace {

constexpr std::size_t kHeadBytes = 84;
constexpr std::size_t kTriangleBytes = 50;

using Point = std::array<float, 3>;

struct PointHash {
  std::size_t operator()(const Point& point) const {
    std::uint64_t hash = 0;
    for (const float value : point) {
      // Zero and minus zero are equal, so they hash alike.
      const auto bits = value == 0.0F ? 0U : std::bit_cast<std::uint32_t>(value);
      hash = (hash ^ bits) * 0x9E3779B97F4A7C15ULL;
      hash ^= hash >> 32U;
    }
    return hash;
  }
};

/// Merges coincident corners into one vertex.
class CornerMerger {
 public:
  void add_triangle(const std::array<Point, 3>& points) {
    builder_.add_face(std::array{vertex(points[0]), vertex(points[1]), vertex(points[2])});
  }
  [[nodiscard]] SurfaceMesh mesh() const { return builder_.mesh(); }

 private:
  int vertex(const Point& point) {
    const auto [entry, is_new] =
        vertices_.try_emplace(point, static_cast<int>(builder_.vertex_count()));
    if (is_new) {
      builder_.add_vertex(static_cast<double>(point[0]), static_cast<double>(point[1]),
                          static_cast<double>(point[2]));
    }
    return entry->second;
  }

  MeshBuilder builder_;
  std::unordered_map<Point, int, PointHash> vertices_;
};

std::uint32_t triangles_announced(std::string_view content) {
  std::uint32_t count = 0;
  std::memcpy(&count, content.data() + kHeadBytes - sizeof count, sizeof count);
  return count;
}

std::size_t binary_size(std::string_view content) {
  return kHeadBytes + kTriangleBytes * std::size_t{triangles_announced(content)};
}

SurfaceMesh read_binary(std::string_view content) {
  CornerMerger merger;
  for (std::size_t at = kHeadBytes; at < content.size(); at += kTriangleBytes) {
    std::array<Point, 3> corners{};
    std::memcpy(&corners, content.data() + at + sizeof(Point), sizeof corners);  // Past the normal.
    merger.add_triangle(corners);
  }
  return merger.mesh();
}

void expect(MeshText& text, std::string_view keyword) {
  const std::string_view word = text.word_of_any_line(std::string(keyword));
  if (same_word(word, keyword)) return;
  text.refuse("has " + quoted_word(word) + " where \"" + std::string(keyword) + "\" must stand");
}

Point read_point(MeshText& text, const std::string& meaning) {
  Point point{};
  for (float& value : point) {
    const std::string_view word = text.word_of_any_line(meaning);
    value = static_cast<float>(text.number_from(word, meaning));
  }
  return point;
}

void read_facet(MeshText& text, CornerMerger& merger) {
  expect(text, "normal");
  read_point(text, "a number of a normal");
  expect(text, "outer");
  expect(text, "loop");
  std::array<Point, 3> corners{};
  for (Point& corner : corners) {
    expect(text, "vertex");
    corner = read_point(text, "a coordinate of a vertex");
  }
  merger.add_triangle(corners);
  expect(text, "endloop");
  expect(text, "endfacet");
}

bool at_facet(MeshText text) {
  return same_word(text.word(), "facet") && same_word(text.word(), "normal");
}

/// The solid's name, if it has one: the rest of the line, or up to a facet on the same line.
void pass_name(MeshText& text) {
  while (!at_facet(text) && !text.word().empty()) {
  }
}

void read_solid(MeshText& text, CornerMerger& merger) {
  pass_name(text);
  for (;;) {
    std::string_view word = text.word();
    if (word.empty() && text.next_line()) word = text.word();
    if (word.empty()) text.refuse("is truncated: it has no \"endsolid\"");
    if (same_word(word, "endsolid")) return;
    if (!same_word(word, "facet")) {
      text.refuse("has " + quoted_word(word) + " where \"facet\" or \"endsolid\" must stand");
    }
    read_facet(text, merger);
  }
}

SurfaceMesh read_text(std::string_view content, const std::string& name) {
  MeshText text(content, name, MeshText::Form::kPlain);
  CornerMerger merger;
  // The rest of the "endsolid" line repeats the solid's name.
  while (text.next_line()) {
    if (const auto word = text.word(); !same_word(word, "solid")) {
      text.refuse("has " + quoted_word(word) + " where \"solid\" must stand");
    }
    read_solid(text, merger);
  }
  return merger.mesh();
}

}  // namespace

SurfaceMesh read_stl(std::string_view content, const std::string& name) {
  const bool has_head = content.size() >= kHeadBytes;
  if (has_head && content.size() == binary_size(content)) return read_binary(content);
  const bool is_text = content.substr(0, 2 * kHeadBytes).find('\0') == std::string_view::npos;
  if (is_text && same_word(without_lead(content).substr(0, 5), "solid"))
    return read_text(content, name);
  if (!has_head) {
    throw InputError(name + ": is " + std::to_string(content.size()) +
                     " bytes long: a binary STL mesh has 84 at least, one as text begins with "
                     "\"solid\"");
  }
  throw InputError(name + ": is " + std::to_string(content.size()) + " bytes long, its header of " +
                   std::to_string(triangles_announced(content)) + " triangles calls for " +
                   std::to_string(binary_size(content)) + ": it is truncated or corrupt");
}

}  // namespace lensforge
