// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/io/files.h"
#include "core/text/json_fields.h"
#include "core/text/json_text.h"
#include "core/text/printable.h"
#include "export/mesh_content.h"

// glTF 2.0 specification, sections 3 (accessors, meshes, nodes) and 4 (GLB).
namespace lensforge {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

static_assert(std::endian::native == std::endian::little, "GLB is little-endian");

/// Bytes of a description that is read: that of a scene with a million parts.
constexpr std::uint64_t kMaxDescription = std::uint64_t{1} << 28U;

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

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

}  // namespace lensforge
