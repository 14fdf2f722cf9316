// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/mesh_readers.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

// PLY: Turk, "The PLY Polygon File Format", 1.0.

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

std::optional<std::size_t> PlyElement::index_of(const std::vector<std::string_view>& names) const {
  for (std::size_t i = 0; i < properties.size(); ++i) {
    if (std::find(names.begin(), names.end(), properties[i].name) != names.end()) return i;
  }
  return std::nullopt;
}

struct PlyHeader {
  enum class Format { kText, kLittleEndian, kBigEndian };
  Format format = Format::kText;
  std::vector<PlyElement> elements;
  std::size_t end = 0;     ///< Offset of the data.
  std::int64_t lines = 0;  ///< Lines of the header, including the last.
};

/// Names for the list of a face's vertices.
const std::vector<std::string_view> kPlyVertexLists{"vertex_indices", "vertex_index"};

constexpr std::array<std::pair<std::string_view, PlyType>, 16> kPlyTypes{{
    {"char", {PlyType::Kind::kSigned, 1}},
    {"int8", {PlyType::Kind::kSigned, 1}},
    {"uchar", {PlyType::Kind::kUnsigned, 1}},
    {"uint8", {PlyType::Kind::kUnsigned, 1}},
    {"short", {PlyType::Kind::kSigned, 2}},
    {"int16", {PlyType::Kind::kSigned, 2}},
    {"ushort", {PlyType::Kind::kUnsigned, 2}},
    {"uint16", {PlyType::Kind::kUnsigned, 2}},
    {"int", {PlyType::Kind::kSigned, 4}},
    {"int32", {PlyType::Kind::kSigned, 4}},
    {"uint", {PlyType::Kind::kUnsigned, 4}},
    {"uint32", {PlyType::Kind::kUnsigned, 4}},
    {"float", {PlyType::Kind::kFloat, 4}},
    {"float32", {PlyType::Kind::kFloat, 4}},
    {"double", {PlyType::Kind::kFloat, 8}},
    {"float64", {PlyType::Kind::kFloat, 8}},
}};

/// The next word in small letters: some programs write capitals.
std::string small_word(MeshText& text) { return lower_case(std::string(text.word())); }

PlyType read_type(MeshText& text) {
  const std::string word = small_word(text);
  for (const auto& [name, type] : kPlyTypes) {
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
    if (property.count_type->kind == PlyType::Kind::kFloat) {
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
  return list.count_type && list.type.kind != PlyType::Kind::kFloat;
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

/// Reads the header of a PLY file.
/// @throw InputError "name: line N: …" for a line unknown to the format, a "vertex" without three
///        coordinates, a "face" without a list of vertices, or more data announced than `content`
///        can hold.
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

namespace {

// OBJ: Wavefront, "Object Files (.obj)", version 3.0: indices count from 1, negative ones from the
// last vertex back. Lines that do not belong to the mesh (normals, groups, materials, …) are
// ignored, and so are values after z: a weight, or a colour.

/// A vertex from the rest of a line.
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

namespace {

// OFF: Geomview manual, "OFF Files": [ST][C][N][4][n]OFF, which may be left out, then the numbers
// of vertices, faces and edges, then a line for each vertex and each face. 4OFF and nOFF do not
// have three coordinates.

constexpr std::array<std::string_view, 8> kOffKeywords{"off",   "coff",   "noff",   "cnoff",
                                                       "stoff", "stcoff", "stnoff", "stcnoff"};

bool is_keyword(std::string_view word) {
  return std::any_of(kOffKeywords.begin(), kOffKeywords.end(),
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
    read_vertex(text, builder);
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

namespace {

// STL. Binary: 80 arbitrary bytes, a count, then 50 bytes per triangle (normal, three corners, two
// arbitrary bytes). Text: solid { facet normal n { outer loop { vertex v } endloop } endfacet }
// endsolid, with any white space between words. A binary file may begin with "solid" too, so its
// size decides; if the size does not match, a zero byte, which text never contains.

constexpr std::size_t kStlHeadBytes = 84;
constexpr std::size_t kStlRecordBytes = 50;

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
  std::memcpy(&count, content.data() + kStlHeadBytes - sizeof count, sizeof count);
  return count;
}

std::size_t binary_size(std::string_view content) {
  return kStlHeadBytes + kStlRecordBytes * std::size_t{triangles_announced(content)};
}

SurfaceMesh read_binary(std::string_view content) {
  CornerMerger merger;
  for (std::size_t at = kStlHeadBytes; at < content.size(); at += kStlRecordBytes) {
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
  const bool has_head = content.size() >= kStlHeadBytes;
  if (has_head && content.size() == binary_size(content)) return read_binary(content);
  const bool is_text = content.substr(0, 2 * kStlHeadBytes).find('\0') == std::string_view::npos;
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
