// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/surface/mesh_builder.h"
#include "core/surface/mesh_readers.h"
#include "core/surface/mesh_text.h"
#include "core/surface/ply_header.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

static_assert(std::endian::native == std::endian::little, "binary PLY is turned by hand");

template <class Number>
double as(const std::array<char, 8>& raw) {
  Number number{};
  std::memcpy(&number, raw.data(), sizeof number);
  return static_cast<double>(number);
}

/// The number that little-endian bytes encode.
double number_of(const std::array<char, 8>& raw, const PlyType& type) {
  const bool is_signed = type.kind == PlyType::Kind::kSigned;
  if (type.kind == PlyType::Kind::kFloat) return type.bytes == 4 ? as<float>(raw) : as<double>(raw);
  if (type.bytes == 1) return is_signed ? as<std::int8_t>(raw) : as<std::uint8_t>(raw);
  if (type.bytes == 2) return is_signed ? as<std::int16_t>(raw) : as<std::uint16_t>(raw);
  return is_signed ? as<std::int32_t>(raw) : as<std::uint32_t>(raw);
}

/// Reads the numbers after the header in sequence.
class PlyNumbers {
 public:
  PlyNumbers(std::string_view content, const std::string& name, const PlyHeader& header)
      : format_(header.format),
        name_(name),
        bytes_(content.substr(header.end)),
        text_(bytes_, name, MeshText::Form::kPlain, header.lines) {}

  double next(const PlyType& type) {
    if (format_ == PlyHeader::Format::kText) {
      return text_.number_from(text_.word_of_any_line("a number"), "a number");
    }
    if (bytes_.size() < type.bytes) refuse("is truncated: its data end too early");
    std::array<char, 8> raw{};
    std::copy_n(bytes_.begin(), type.bytes, raw.begin());
    bytes_.remove_prefix(type.bytes);
    if (format_ == PlyHeader::Format::kBigEndian) {
      std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(type.bytes));
    }
    return number_of(raw, type);
  }

  /// A whole number of at most 32 bits, the maximum of PLY's types.
  std::int64_t next_whole(const PlyType& type) {
    const double value = next(type);
    if (!(std::abs(value) <= 4294967295.0) || value != std::trunc(value)) {
      refuse("has " + number_text(value) + " where a whole number must stand");
    }
    return static_cast<std::int64_t>(value);
  }

  std::int64_t next_count(const PlyType& type) {
    const std::int64_t count = next_whole(type);
    if (count < 0) refuse("has a list of " + std::to_string(count) + " numbers");
    return count;
  }

  /// @throw InputError if surplus text follows.
  void finish() {
    if (format_ != PlyHeader::Format::kText) return;
    std::string_view word = text_.word();
    if (word.empty() && text_.next_line()) word = text_.word();
    if (!word.empty()) {
      text_.refuse("has " + quoted_word(word) +
                   " after the last element that its header announces");
    }
  }

  /// Throws, naming the line if the file is text.
  [[noreturn]] void refuse(const std::string& why) const {
    if (format_ == PlyHeader::Format::kText) text_.refuse(why);
    throw InputError(name_ + ": " + why);
  }

 private:
  PlyHeader::Format format_;
  std::string name_;
  std::string_view bytes_;
  MeshText text_;
};

void skip(const PlyProperty& property, PlyNumbers& numbers) {
  const std::int64_t count = property.count_type ? numbers.next_count(*property.count_type) : 1;
  for (std::int64_t i = 0; i < count; ++i) numbers.next(property.type);
}

void read_vertex(const PlyElement& element, PlyNumbers& numbers, MeshBuilder& builder) {
  std::array<double, 3> point{};
  for (const PlyProperty& property : element.properties) {
    const std::size_t axis = std::string_view("xyz").find(property.name);
    if (property.name.size() == 1 && axis < point.size()) {
      point[axis] = numbers.next(property.type);
    } else {
      skip(property, numbers);
    }
  }
  builder.add_vertex(point[0], point[1], point[2]);
}

void read_corners(const PlyProperty& list, PlyNumbers& numbers, MeshBuilder& builder) {
  const std::int64_t count = numbers.next_count(*list.count_type);
  if (count < 3) numbers.refuse(corner_problem(builder.face_count(), count));
  std::vector<int> corners;
  for (std::int64_t k = 0; k < count; ++k) {
    const std::int64_t vertex = numbers.next_whole(list.type);
    // Indices are checked after all vertices are read.
    if (!std::in_range<int>(vertex)) {
      numbers.refuse("a face uses vertex " + std::to_string(vertex) + ": there is none");
    }
    corners.push_back(static_cast<int>(vertex));
  }
  builder.add_face(corners);
}

void read_face(const PlyElement& element, std::size_t list, PlyNumbers& numbers,
               MeshBuilder& builder) {
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    if (i == list) {
      read_corners(element.properties[i], numbers, builder);
    } else {
      skip(element.properties[i], numbers);
    }
  }
}

void read_element(const PlyElement& element, PlyNumbers& numbers, MeshBuilder& builder) {
  if (element.properties.empty()) return;
  const std::size_t list = element.index_of(kPlyVertexLists).value_or(0);
  for (std::int64_t i = 0; i < element.count; ++i) {
    if (element.name == "vertex") {
      read_vertex(element, numbers, builder);
    } else if (element.name == "face") {
      read_face(element, list, numbers, builder);
    } else {
      for (const PlyProperty& property : element.properties) skip(property, numbers);
    }
  }
}

}  // namespace

SurfaceMesh read_ply(std::string_view content, const std::string& name) {
  const PlyHeader header = read_ply_header(content, name);
  PlyNumbers numbers(content, name, header);
  MeshBuilder builder;
  for (const PlyElement& element : header.elements) read_element(element, numbers, builder);
  numbers.finish();
  return builder.mesh();
}

}  // namespace lensforge
