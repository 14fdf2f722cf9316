// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// A type of numbers in a PLY file.
struct PlyType {
  enum class Kind { kSigned, kUnsigned, kFloat };
  Kind kind = Kind::kFloat;
  std::size_t bytes = 4;
};

struct PlyProperty {
  std::string name;
  PlyType type;
  std::optional<PlyType> count_type;  ///< Lists only.
};

struct PlyElement {
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;

  /// Index of the first property named in `names`; nothing if there is none.
  [[nodiscard]] std::optional<std::size_t> index_of(
      const std::vector<std::string_view>& names) const;
};

struct PlyHeader {
  enum class Format { kText, kLittleEndian, kBigEndian };
  Format format = Format::kText;
  std::vector<PlyElement> elements;
  std::size_t end = 0;     ///< Offset of the data.
  std::int64_t lines = 0;  ///< Lines of the header, including the last.
};

/// Reads the header of PLY 1.0 (Turk, "The PLY Polygon File Format").
/// @throw InputError "name: line N: …" for a line unknown to the format, a "vertex" without three
///        coordinates, a "face" without a list of vertices, or more data announced than `content`
///        can hold.
PlyHeader read_ply_header(std::string_view content, const std::string& name);

/// Names for the list of a face's vertices.
inline const std::vector<std::string_view> kPlyVertexLists{"vertex_indices", "vertex_index"};

}  // namespace lensforge
