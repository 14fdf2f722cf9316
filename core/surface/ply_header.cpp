// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/ply_header.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/surface/mesh_text.h"
#include "core/text/lower_case.h"

namespace lensforge {
namespace {

using Kind = PlyType::Kind;

constexpr std::array<std::pair<std::string_view, PlyType>, 16> kTypes{{
    {"char", {Kind::kSigned, 1}},
    {"int8", {Kind::kSigned, 1}},
    {"uchar", {Kind::kUnsigned, 1}},
    {"uint8", {Kind::kUnsigned, 1}},
    {"short", {Kind::kSigned, 2}},
    {"int16", {Kind::kSigned, 2}},
    {"ushort", {Kind::kUnsigned, 2}},
    {"uint16", {Kind::kUnsigned, 2}},
    {"int", {Kind::kSigned, 4}},
    {"int32", {Kind::kSigned, 4}},
    {"uint", {Kind::kUnsigned, 4}},
    {"uint32", {Kind::kUnsigned, 4}},
    {"float", {Kind::kFloat, 4}},
    {"float32", {Kind::kFloat, 4}},
    {"double", {Kind::kFloat, 8}},
    {"float64", {Kind::kFloat, 8}},
}};

/// The next word in small letters: some programs write capitals.
std::string small_word(MeshText& text) { return lower_case(std::string(text.word())); }

PlyType read_type(MeshText& text) {
  const std::string word = small_word(text);
  for (const auto& [name, type] : kTypes) {
    if (word == name) return type;
  }
  text.refuse("has a property of type " + quoted_word(word) +
              ": PLY has char, uchar, short, ushort, int, uint, float and double");
}

PlyHeader::Format read_format(MeshText& text) {
  const std::string word = small_word(text);
  if (word == "ascii") return PlyHeader::Format::kText;
  if (word == "binary_little_endian") return PlyHeader::Format::kLittleEndian;
  if (word == "binary_big_endian") return PlyHeader::Format::kBigEndian;
  text.refuse("has the format " + quoted_word(word) +
              ": PLY has ascii, binary_little_endian and binary_big_endian");
}

PlyElement read_element(MeshText& text, const PlyHeader& header) {
  PlyElement element;
  element.name = small_word(text);
  element.count = text.whole_from(text.word(), "the number of an element");
  const bool is_known =
      std::any_of(header.elements.begin(), header.elements.end(),
                  [&](const PlyElement& earlier) { return earlier.name == element.name; });
  if (is_known) text.refuse("has the element " + quoted_word(element.name) + " twice");
  if (element.count < 0 || !std::in_range<std::int32_t>(element.count)) {
    text.refuse("announces " + std::to_string(element.count) + " of the element " +
                quoted_word(element.name) + ": it must be in 0 to 2147483647");
  }
  return element;
}

PlyProperty read_property(MeshText& text, const PlyElement& element) {
  PlyProperty property;
  MeshText after_list = text;
  if (small_word(after_list) == "list") {
    text = after_list;
    property.count_type = read_type(text);
    if (property.count_type->kind == Kind::kFloat) {
      text.refuse("has a list whose count is not an integer type; use uchar or int");
    }
  }
  property.type = read_type(text);
  property.name = small_word(text);
  if (property.name.empty()) text.refuse("has a property without a name");
  if (element.index_of({property.name})) {
    text.refuse("has the property " + quoted_word(property.name) + " twice");
  }
  return property;
}

/// Minimum bytes of one element.
std::int64_t smallest_size(const PlyElement& element, PlyHeader::Format format) {
  std::int64_t bytes = 0;
  for (const PlyProperty& property : element.properties) {
    const PlyType& type = property.count_type ? *property.count_type : property.type;
    // Text: a digit and a blank.
    bytes += format == PlyHeader::Format::kText ? 2 : static_cast<std::int64_t>(type.bytes);
  }
  return bytes;
}

bool is_scalar(const PlyElement& element, std::string_view name) {
  const auto index = element.index_of({name});
  return index && !element.properties[*index].count_type;
}

bool has_corners(const PlyElement& face) {
  const auto index = face.index_of(kPlyVertexLists);
  if (!index) return false;
  const PlyProperty& list = face.properties[*index];
  return list.count_type && list.type.kind != Kind::kFloat;
}

void check_elements(const PlyHeader& header, std::size_t size, const MeshText& text) {
  const auto data = static_cast<std::int64_t>(size - header.end) + 1;  // No blank at the end.
  for (const PlyElement& element : header.elements) {
    const std::int64_t each = smallest_size(element, header.format);
    if (each > 0 && element.count > data / each) {
      text.refuse("announces " + std::to_string(element.count) + " of the element " +
                  quoted_word(element.name) + ", but only " + std::to_string(data - 1) +
                  " bytes follow: it is truncated or corrupt");
    }
    const bool lies = is_scalar(element, "x") && is_scalar(element, "y") && is_scalar(element, "z");
    if (element.name == "vertex" && !lies) {
      text.refuse("has vertices without the properties x, y and z");
    }
    if (element.name == "face" && !has_corners(element)) {
      text.refuse("has faces without an integer list vertex_indices");
    }
  }
}

}  // namespace

std::optional<std::size_t> PlyElement::index_of(const std::vector<std::string_view>& names) const {
  for (std::size_t i = 0; i < properties.size(); ++i) {
    if (std::find(names.begin(), names.end(), properties[i].name) != names.end()) return i;
  }
  return std::nullopt;
}

PlyHeader read_ply_header(std::string_view content, const std::string& name) {
  MeshText text(content, name, MeshText::Form::kPlain);
  PlyHeader header;
  bool has_format = false;
  bool has_end = false;
  if (!text.next_line() || small_word(text) != "ply")
    text.refuse("is no PLY mesh: \"ply\" is missing");
  while (text.next_line()) {
    const std::string keyword = small_word(text);
    has_end = keyword == "end_header";
    if (has_end) break;
    if (keyword == "format") {
      header.format = read_format(text);
      has_format = true;
    } else if (keyword == "element") {
      header.elements.push_back(read_element(text, header));
    } else if (keyword == "property") {
      if (header.elements.empty()) text.refuse("has a property before any element");
      PlyElement& element = header.elements.back();
      element.properties.push_back(read_property(text, element));
    } else if (keyword != "comment" && keyword != "obj_info") {
      text.refuse("begins with " + quoted_word(keyword) + ": no PLY header has that");
    }
  }
  // The line's end belongs to the header too.
  const std::string_view all = content.substr(0, text.end_of_line());
  if (!has_end || !(all.ends_with('\n') || all.ends_with('\r'))) {
    text.refuse("is truncated: its header has no \"end_header\"");
  }
  if (!has_format) text.refuse("has no \"format\" in its header");
  header.end = all.size();
  // If lines end with CR alone, an LF after the header is the first byte of the data.
  if (all.ends_with("\r\n") && std::count(all.begin(), all.end(), '\n') == 1) --header.end;
  header.lines = text.line();
  check_elements(header, content.size(), text);
  return header;
}

}  // namespace lensforge
