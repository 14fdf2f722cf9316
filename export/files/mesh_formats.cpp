// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/files/mesh_formats.h"

#include <libxml/xmlreader.h>
#include <zip.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"
#include "core/mesh/mesh_files.h"
#include "core/mesh/surface_mesh.h"
#include "core/schema/json.h"
#include "core/text/version.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr int kDecimals = 9;

/// The shortest text that reads back as the same double.
void append_exact(std::string& text, double value) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  text.append(digits.data(), end);
}

void append_fixed(std::string& text, double value) {
  std::array<char, 64> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                 std::chars_format::fixed, kDecimals)
                       .ptr;
  text.append(digits.data(), end);
}

std::string xml_escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string model_xml(const SurfaceMesh& mesh, const std::string& title) {
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<model unit=\"millimeter\" xml:lang=\"en-US\" "
      "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n"
      "<metadata name=\"Title\">" +
      xml_escaped(title) +
      "</metadata>\n<resources><object id=\"1\" type=\"model\"><mesh>\n<vertices>\n";
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    for (int k = 0; k < 3; ++k) {
      xml += std::array{"<vertex x=\"", "\" y=\"", "\" z=\""}[static_cast<std::size_t>(k)];
      append_fixed(xml, mesh.vertices(k, v));
    }
    xml += "\"/>\n";
  }
  xml += "</vertices>\n<triangles>\n";
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      xml += std::array{"<triangle v1=\"", "\" v2=\"", "\" v3=\""}[static_cast<std::size_t>(k)];
      xml += std::to_string(mesh.triangles(k, t));
    }
    xml += "\"/>\n";
  }
  return xml +
         "</triangles>\n</mesh></object></resources>\n<build><item objectid=\"1\"/></build>\n"
         "</model>\n";
}

constexpr std::string_view kContentTypes =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
    "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">"
    "<Default Extension=\"rels\" "
    "ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>"
    "<Default Extension=\"model\" "
    "ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>\n";

constexpr std::string_view kRelations =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
    "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
    "<Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" "
    "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>\n";

/// A zip archive that is being written; discarded unless close() is reached.
class ZipWriter {
 public:
  ZipWriter(const fs::path& beside, const fs::path& path) : path_(path) {
    int error = 0;
    zip_.reset(zip_open(beside.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &error));
    if (zip_) return;
    zip_error_t why;
    zip_error_init_with_code(&why, error);
    const std::string reason = zip_error_strerror(&why);
    zip_error_fini(&why);
    throw RunError(path_.string() + ": cannot be written: " + reason);
  }

  /// `content` must live until close().
  void add(const char* name, std::string_view content) {
    zip_source_t* source = zip_source_buffer(zip_.get(), content.data(), content.size(), 0);
    const zip_int64_t index =
        source == nullptr ? -1 : zip_file_add(zip_.get(), name, source, ZIP_FL_ENC_UTF_8);
    if (index < 0) fail();
    // Else the archive bears the time, and the same solid gives another file every second.
    zip_file_set_dostime(zip_.get(), static_cast<zip_uint64_t>(index), 0, kFirstDay, 0);
  }

  /// Uncompressed text at the archive's end.
  void comment(const std::string& text) {
    if (zip_set_archive_comment(zip_.get(), text.data(), static_cast<zip_uint16_t>(text.size()))) {
      fail();
    }
  }

  void close() {
    if (zip_close(zip_.get()) != 0) fail();
    static_cast<void>(zip_.release());
  }

 private:
  static constexpr zip_uint16_t kFirstDay = 0x21;  // 1980-01-01, the earliest that zip knows.

  [[noreturn]] void fail() {
    throw RunError(path_.string() + ": cannot be written: " + zip_strerror(zip_.get()));
  }

  struct Discard {
    void operator()(zip_t* zip) const { zip_discard(zip); }
  };

  fs::path path_;
  std::unique_ptr<zip_t, Discard> zip_;
};

}  // namespace

void write_obj(const SurfaceMesh& mesh, const std::string& title, const fs::path& path) {
  std::string text = "# " + title + "\n# millimetres\n";
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    text += 'v';
    for (int k = 0; k < 3; ++k) {
      text += ' ';
      append_exact(text, mesh.vertices(k, v));
    }
    text += '\n';
  }
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    text += 'f';
    for (int k = 0; k < 3; ++k) text += ' ' + std::to_string(mesh.triangles(k, t) + 1);
    text += '\n';
  }
  write_whole_file(path, text);
}

void write_3mf(const SurfaceMesh& mesh, const std::string& title, const fs::path& path) {
  const std::string model = model_xml(mesh, title);
  write_whole_file(path, [&](const fs::path& beside) {
    ZipWriter zip(beside, path);
    zip.add("[Content_Types].xml", kContentTypes);
    zip.add("_rels/.rels", kRelations);
    zip.add("3D/3dmodel.model", model);
    zip.comment(title);
    zip.close();
  });
}

namespace {

/// Bytes of a model that are read, unpacked: 40 million triangles.
constexpr std::uint64_t kMaxModel = std::uint64_t{1} << 32U;
/// Bytes of a foreign value in a message.
constexpr std::size_t kLongestValue = 40;

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

template <auto kFree>
struct Free {
  template <class T>
  void operator()(T* thing) const {
    kFree(thing);
  }
};

using Zip = std::unique_ptr<zip_t, Free<zip_discard>>;
using ZipEntry = std::unique_ptr<zip_file_t, Free<zip_fclose>>;
using Reader = std::unique_ptr<xmlTextReader, Free<xmlFreeTextReader>>;
using Text = std::unique_ptr<xmlChar, decltype([](xmlChar* text) { xmlFree(text); })>;

Zip opened_zip(const fs::path& path) {
  require_regular_file(path);
  int error = 0;
  Zip zip(zip_open(path.c_str(), ZIP_RDONLY, &error));
  if (!zip) refuse(path, "is no 3MF package: it is no zip archive that can be read");
  return zip;
}

/// Opens the model at its usual path, or else the first file with a model's name.
ZipEntry opened_model(const Zip& zip, const fs::path& path) {
  zip_int64_t found = zip_name_locate(zip.get(), "3D/3dmodel.model", ZIP_FL_NOCASE);
  const zip_int64_t entries = zip_get_num_entries(zip.get(), 0);
  for (zip_int64_t i = 0; i < entries && found < 0; ++i) {
    const char* name = zip_get_name(zip.get(), static_cast<zip_uint64_t>(i), 0);
    if (name != nullptr && std::string_view(name).ends_with(".model")) found = i;
  }
  if (found < 0) refuse(path, "is no 3MF package: it holds no model");
  ZipEntry entry(zip_fopen_index(zip.get(), static_cast<zip_uint64_t>(found), 0));
  if (!entry) refuse(path, "holds a model that cannot be unpacked");
  return entry;
}

/// A file in the archive, up to kMaxModel bytes of it.
struct ModelStream {
  ZipEntry entry;
  std::uint64_t bytes = 0;

  /// Callback by which libxml2 reads more.
  static int read(void* context, char* buffer, int size) {
    auto& stream = *static_cast<ModelStream*>(context);
    const zip_int64_t got = zip_fread(stream.entry.get(), buffer, static_cast<zip_uint64_t>(size));
    if (got < 0) return -1;
    stream.bytes += static_cast<std::uint64_t>(got);
    return stream.bytes > kMaxModel ? -1 : static_cast<int>(got);
  }
};

std::string text_of(const xmlChar* text) {
  return text == nullptr ? "" : reinterpret_cast<const char*>(text);
}

/// A unit of 3MF, mm; 0 for another word.
double unit_size(std::string_view word) {
  constexpr std::array<std::pair<std::string_view, double>, 6> kUnits{{{"micron", 1e-3},
                                                                       {"millimeter", 1.0},
                                                                       {"centimeter", 10.0},
                                                                       {"inch", 25.4},
                                                                       {"foot", 304.8},
                                                                       {"meter", 1000.0}}};
  const auto found = std::find_if(kUnits.begin(), kUnits.end(),
                                  [&](const auto& unit) { return unit.first == word; });
  return found == kUnits.end() ? 0.0 : found->second;
}

/// Goes through a model once, without keeping it.
class ModelSurvey {
 public:
  explicit ModelSurvey(const fs::path& path) : path_(path) {}

  MeshContent content() {
    const Zip zip = opened_zip(path_);
    ModelStream stream{opened_model(zip, path_), 0};
    const Reader reader(xmlReaderForIO(ModelStream::read, nullptr, &stream, nullptr, nullptr,
                                       XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING));
    reader_ = reader.get();
    int state = reader_ == nullptr ? -1 : xmlTextReaderRead(reader_);
    for (; state == 1; state = xmlTextReaderRead(reader_)) {
      if (xmlTextReaderNodeType(reader_) == XML_READER_TYPE_ELEMENT) look_at_element();
    }
    if (state != 0) refuse(path_, "holds a model that cannot be read to its end");
    content_.format = "3MF";
    if (content_.triangles == 0) refuse(path_, "holds no triangles");
    return std::move(content_);
  }

 private:
  [[nodiscard]] std::string attribute(const char* name) const {
    const Text value(xmlTextReaderGetAttribute(reader_, reinterpret_cast<const xmlChar*>(name)));
    return text_of(value.get());
  }

  [[nodiscard]] double coordinate(const char* name) const {
    const std::string text = attribute(name);
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
      refuse(path_, std::string(name) + " of a vertex is '" + printable_line(text, kLongestValue) +
                        "': it must be a finite number");
    }
    return unit_ * value;
  }

  void look_at_element() {
    const std::string name = text_of(xmlTextReaderConstLocalName(reader_));
    if (name == "vertex") {
      ++content_.vertices;
      content_.box.extend(Eigen::Vector3d(coordinate("x"), coordinate("y"), coordinate("z")));
    } else if (name == "triangle") {
      ++content_.triangles;
    } else if (name == "mesh") {
      ++content_.meshes;
    } else if (name == "model") {
      look_at_unit();
    } else if (name == "item" || name == "component") {
      content_.moved = content_.moved || !attribute("transform").empty();
    } else if (name == "metadata" && attribute("name") == "Title") {
      const Text title(xmlTextReaderReadString(reader_));
      content_.title = text_of(title.get());
    }
  }

  void look_at_unit() {
    const std::string unit = attribute("unit");
    if (unit.empty()) return;
    unit_ = unit_size(unit);
    if (unit_ > 0.0) return;
    refuse(path_, "is in the unit '" + printable_line(unit, kLongestValue) +
                      "': 3MF has micron, millimeter, centimeter, inch, foot and meter");
  }

  const fs::path& path_;
  xmlTextReader* reader_ = nullptr;
  double unit_ = 1.0;
  MeshContent content_;
};

}  // namespace

MeshContent inspect_3mf(const fs::path& path) { return ModelSurvey(path).content(); }

namespace {

// glTF 2.0 specification, sections 3 (accessors, meshes, nodes, materials) and 4 (GLB).

static_assert(std::endian::native == std::endian::little, "GLB is little-endian");

using Json = nlohmann::ordered_json;

constexpr double kMetres = 1e-3;  ///< A millimetre.

// Numbers of the specification.
constexpr int kFloat = 5126;
constexpr int kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
constexpr std::uint32_t kMagic = 0x46546C67;      // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;  // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004E4942;

/// Vertices with one normal each, metres.
struct Vertices {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;
  std::vector<std::uint32_t> indices;

  void add(const Eigen::Vector3d& place, const Eigen::Vector3d& normal) {
    positions.emplace_back((kMetres * place).cast<float>());
    normals.emplace_back(normal.normalized().cast<float>());
  }
};

/// The triangles `first` … with vertices of their own, and the normals given for them.
void add_smooth(const SurfaceMesh& solid, std::int64_t first, std::int64_t count,
                const Eigen::Matrix3Xd& normals, Vertices& all) {
  std::vector<std::uint32_t> number(static_cast<std::size_t>(normals.cols()),
                                    std::numeric_limits<std::uint32_t>::max());
  for (std::int64_t t = first; t < first + count; ++t) {
    for (const int v : solid.triangles.col(t)) {
      std::uint32_t& own = number[static_cast<std::size_t>(v)];
      if (own == std::numeric_limits<std::uint32_t>::max()) {
        own = static_cast<std::uint32_t>(all.positions.size());
        all.add(solid.vertices.col(v), normals.col(v));
      }
      all.indices.push_back(own);
    }
  }
}

/// Every triangle with three vertices of its own.
void add_flat(const SurfaceMesh& solid, std::int64_t first, std::int64_t count, Vertices& all) {
  for (std::int64_t t = first; t < first + count; ++t) {
    const Eigen::Vector3d normal = area_normal(solid, t);
    for (const int v : solid.triangles.col(t)) {
      all.indices.push_back(static_cast<std::uint32_t>(all.positions.size()));
      all.add(solid.vertices.col(v), normal);
    }
  }
}

Vertices vertices_of(const ClosedMesh& part) {
  Vertices all;
  const std::int64_t back = part.solid.triangle_count() - part.curved_back;
  add_smooth(part.solid, 0, part.surface_triangles, part.normals, all);
  add_flat(part.solid, part.surface_triangles, back - part.surface_triangles, all);
  if (part.curved_back > 0) {
    SurfaceMesh curved = part.solid;
    curved.triangles = part.solid.triangles.rightCols(part.curved_back).eval();
    add_smooth(part.solid, back, part.curved_back, vertex_area_normals(curved), all);
  }
  return all;
}

Json material_of(const ClosedMesh& part) {
  Json material{{"name", part.mirror ? "mirror" : "clear"},
                {"pbrMetallicRoughness",
                 Json{{"metallicFactor", part.mirror ? 1.0 : 0.0}, {"roughnessFactor", 0.0}}}};
  if (part.mirror) return material;
  const double thickness = kMetres * part.solid.vertices.row(2).maxCoeff();
  material["extensions"] = Json{{"KHR_materials_transmission", Json{{"transmissionFactor", 1.0}}},
                                {"KHR_materials_volume", Json{{"thicknessFactor", thickness}}},
                                {"KHR_materials_ior", Json{{"ior", part.ior}}}};
  return material;
}

/// A part of the buffer with the vertices' numbers.
struct Block {
  std::span<const char> bytes;
  int target;
};

template <class Item>
Block block_of(const std::vector<Item>& items, int target) {
  return {{reinterpret_cast<const char*>(items.data()), items.size() * sizeof(Item)}, target};
}

Json box(const Eigen::Vector3f& corner) {
  return Json::array({corner.x(), corner.y(), corner.z()});
}

Json accessors_of(const Vertices& all) {
  Eigen::Vector3f low = all.positions.front();
  Eigen::Vector3f high = low;
  for (const Eigen::Vector3f& p : all.positions) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const auto accessor = [](int view, int type, std::size_t count, const char* shape) {
    return Json{{"bufferView", view}, {"componentType", type}, {"count", count}, {"type", shape}};
  };
  Json positions = accessor(0, kFloat, all.positions.size(), "VEC3");
  positions["min"] = box(low);
  positions["max"] = box(high);
  return Json::array({std::move(positions), accessor(1, kFloat, all.normals.size(), "VEC3"),
                      accessor(2, kUnsignedInt, all.indices.size(), "SCALAR")});
}

/// One after the other in the one buffer.
Json views_of(std::span<const Block> blocks) {
  Json views = Json::array();
  std::size_t offset = 0;
  for (const Block& block : blocks) {
    views.push_back(Json{{"buffer", 0},
                         {"byteOffset", offset},
                         {"byteLength", block.bytes.size()},
                         {"target", block.target}});
    offset += block.bytes.size();
  }
  return views;
}

Json description(const ClosedMesh& part, const std::string& title, const Vertices& all,
                 std::span<const Block> blocks, std::uint64_t buffer_bytes) {
  const Json primitive{
      {"attributes", Json{{"POSITION", 0}, {"NORMAL", 1}}}, {"indices", 2}, {"material", 0}};
  Json json{{"asset", Json{{"version", "2.0"}, {"generator", program_mark()}}}, {"scene", 0}};
  if (!part.mirror) {
    json["extensionsUsed"] =
        Json::array({"KHR_materials_transmission", "KHR_materials_volume", "KHR_materials_ior"});
  }
  json["scenes"] = Json::array({Json{{"nodes", Json::array({0})}}});
  json["nodes"] = Json::array({Json{{"name", title}, {"mesh", 0}}});
  json["meshes"] = Json::array({Json{{"primitives", Json::array({primitive})}}});
  json["materials"] = Json::array({material_of(part)});
  json["accessors"] = accessors_of(all);
  json["bufferViews"] = views_of(blocks);
  json["buffers"] = Json::array({Json{{"byteLength", buffer_bytes}}});
  return json;
}

void append(std::string& bytes, std::uint64_t number) {
  for (unsigned shift = 0; shift < 32; shift += 8) {
    bytes += static_cast<char>(number >> shift & 0xFFU);
  }
}

}  // namespace

void write_glb(const ClosedMesh& part, const std::string& title, const fs::path& path) {
  const Vertices all = vertices_of(part);
  const std::vector<Block> blocks{block_of(all.positions, kArrayBuffer),
                                  block_of(all.normals, kArrayBuffer),
                                  block_of(all.indices, kElementArrayBuffer)};
  std::uint64_t binary = 0;  // All blocks are whole numbers of 4 bytes.
  for (const Block& block : blocks) binary += block.bytes.size();
  std::string json = description(part, title, all, blocks, binary).dump();
  json.append((4 - json.size() % 4) % 4, ' ');
  const std::uint64_t length = 12 + 8 + json.size() + 8 + binary;
  if (length > std::numeric_limits<std::uint32_t>::max()) {
    throw RunError(path.string() + ": would be longer than the 4 GiB of a .glb file; use .ply");
  }
  std::string bytes;
  bytes.reserve(length);
  for (const std::uint64_t number : {std::uint64_t{kMagic}, std::uint64_t{2}, length}) {
    append(bytes, number);
  }
  append(bytes, json.size());
  append(bytes, kJsonChunk);
  bytes += json;
  append(bytes, binary);
  append(bytes, kBinaryChunk);
  for (const Block& block : blocks) bytes.append(block.bytes.data(), block.bytes.size());
  write_whole_file(path, bytes);
}

namespace {

using nlohmann::json;

/// Bytes of a description that is read: that of a scene with a million parts.
constexpr std::uint64_t kMaxDescription = std::uint64_t{1} << 28U;

/// The JSON chunk of a GLB file: it is the first.
std::string glb_description(const fs::path& path) {
  std::ifstream file = open_input(path);
  std::array<char, 20> bytes{};
  file.read(bytes.data(), bytes.size());
  std::array<std::uint32_t, 5> head{};  // "glTF", version, length, JSON's length, "JSON".
  std::memcpy(head.data(), bytes.data(), sizeof head);
  const std::string_view text(bytes.data(), bytes.size());
  if (!file || !text.starts_with("glTF") || text.substr(16) != "JSON" || head[1] != 2) {
    refuse(path, "is no binary glTF 2.0 file: its header is another");
  }
  const std::uintmax_t size = fs::file_size(path);
  if (head[2] != size || head[3] > size - bytes.size() || head[3] > kMaxDescription) {
    refuse(path, "is " + std::to_string(size) + " bytes long, its header calls for " +
                     std::to_string(head[2]) + ": it is truncated or corrupt");
  }
  std::string description(head[3], '\0');
  file.read(description.data(), static_cast<std::streamsize>(description.size()));
  if (!file) refuse(path, "cannot be read to its end");
  return description;
}

class GlbSurvey {
 public:
  GlbSurvey(const json& root, const fs::path& path) : root_(root), path_(path) {}

  MeshContent content() {
    const std::string version = fields(root_, "").object("asset").text("version");
    constexpr std::size_t kLongestVersion = 40;
    if (!version.starts_with("2.")) {
      refuse(path_, "is of glTF version '" + printable_line(version, kLongestVersion) +
                        "': version 2.0 is read");
    }
    content_.format = "glTF " + version;
    for (const json& node : list(root_, "nodes", "")) look_at_node(fields(node, "nodes."));
    for (const json& mesh : list(root_, "meshes", "")) {
      ++content_.meshes;
      for (const json& primitive : list(mesh, "primitives", "meshes.")) {
        add(fields(primitive, "meshes.primitives."));
      }
    }
    if (content_.triangles == 0) refuse(path_, "holds no triangles");
    return std::move(content_);
  }

 private:
  [[nodiscard]] JsonFields fields(const json& object, const std::string& prefix) const {
    return {object, path_.string(), prefix};
  }

  /// An array of the file; nothing where it is left out.
  [[nodiscard]] json::array_t list(const json& object, const std::string& name,
                                   const std::string& prefix) const {
    const JsonFields owner = fields(object, prefix);
    if (!owner.has(name)) return {};
    if (!owner.at(name).is_array()) owner.refuse(name, "it must be a list");
    return owner.at(name);
  }

  void look_at_node(const JsonFields& node) {
    if (content_.title.empty() && node.has("name")) content_.title = node.text("name");
    for (const char* moves : {"matrix", "translation", "rotation", "scale"}) {
      content_.moved = content_.moved || node.has(moves);
    }
  }

  [[nodiscard]] JsonFields accessor(const JsonFields& owner, const std::string& name) const {
    const int number = owner.integer(name);
    const JsonFields all = fields(root_, "");
    if (!all.has("accessors") || !all.at("accessors").is_array() || number < 0 ||
        number >= std::ssize(all.at("accessors"))) {
      owner.refuse(name, "there is no such accessor");
    }
    return fields(all.at("accessors")[static_cast<std::size_t>(number)],
                  "accessors." + std::to_string(number) + ".");
  }

  static std::int64_t count_of(const JsonFields& accessor) {
    const int count = accessor.integer("count");
    if (count < 0) accessor.refuse("count", "it must not be below 0");
    return count;
  }

  void add(const JsonFields& primitive) {
    const JsonFields attributes = primitive.object("attributes");
    const JsonFields places = accessor(attributes, "POSITION");
    const std::int64_t vertices = count_of(places);
    if (seen_.insert(attributes.integer("POSITION")).second) {
      content_.vertices += vertices;
      constexpr double kMillimetres = 1000.0;  // A metre.
      content_.box.extend(kMillimetres * places.number_triple("min"));
      content_.box.extend(kMillimetres * places.number_triple("max"));
    }
    const std::int64_t corners =
        primitive.has("indices") ? count_of(accessor(primitive, "indices")) : vertices;
    constexpr int kTriangles = 4;  // Then strips and fans; less are points and lines.
    const int mode = primitive.has("mode") ? primitive.integer("mode") : kTriangles;
    if (mode == kTriangles) content_.triangles += corners / 3;
    if (mode > kTriangles) content_.triangles += std::max<std::int64_t>(corners - 2, 0);
  }

  const json& root_;
  const fs::path& path_;
  MeshContent content_;
  std::set<int> seen_;  ///< Accessors of positions.
};

}  // namespace

MeshContent inspect_glb(const fs::path& path) {
  const json root = parse_json(glb_description(path), path.string());
  return GlbSurvey(root, path).content();
}

namespace {

/// A format of the solid alone.
template <auto write>
void write_solid(const ClosedMesh& mesh, const std::string& title, const fs::path& path) {
  write(mesh.solid, title, path);
}

void write_solid_ply(const ClosedMesh& mesh, const std::string&, const fs::path& path) {
  write_ply(mesh.solid, path);
}

void write_scene(const ClosedMesh& mesh, const std::string&, const fs::path& path) {
  write_glb(mesh, mesh.mirror ? "mirror" : "lens", path);
}

constexpr std::array kMeshFormats{
    MeshFormat{"stl", "(binary)", write_solid<write_stl>, nullptr},
    MeshFormat{"obj", "", write_solid<write_obj>, nullptr},
    MeshFormat{"ply", "", write_solid_ply, nullptr},
    MeshFormat{"3mf", "", write_solid<write_3mf>, inspect_3mf},
    MeshFormat{"glb", "(clear part for scenes)", write_scene, inspect_glb},
};

}  // namespace

std::span<const MeshFormat> mesh_formats() { return kMeshFormats; }

}  // namespace lensforge
