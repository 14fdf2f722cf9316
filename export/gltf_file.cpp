// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/gltf_file.h"

#include <bit>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"
#include "core/surface/mesh_normals.h"
#include "core/text/version.h"

// glTF 2.0 specification, sections 3 (accessors, meshes, materials) and 4 (GLB).
namespace lensforge {
namespace {

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

Vertices vertices_of(const GltfPart& part) {
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

Json material_of(const GltfPart& part) {
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

Json description(const GltfPart& part, const std::string& title, const Vertices& all,
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

void write_glb(const GltfPart& part, const std::string& title, const std::filesystem::path& path) {
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

}  // namespace lensforge
