// SPDX-License-Identifier: GPL-3.0-or-later
#include <bit>
#include <cstdint>
#include <string>

#include "core/io/files.h"
#include "core/surface/mesh_io.h"
#include "core/surface/mesh_normals.h"

namespace lensforge {
namespace {

// Records are copied from memory unchanged.
static_assert(std::endian::native == std::endian::little, "write_stl writes little-endian STL");

constexpr std::size_t kStlHeader = 80;
constexpr std::size_t kStlTriangle = 12 * sizeof(float) + sizeof(std::uint16_t);

template <class Value>
void append_bytes(std::string& bytes, const Value& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void append_stl_triangle(std::string& bytes, const SurfaceMesh& mesh, Eigen::Index t) {
  append_bytes(bytes, Eigen::Vector3f(area_normal(mesh, t).normalized().cast<float>()));
  for (int k = 0; k < 3; ++k) append_bytes(bytes, Eigen::Vector3f(mesh.corner(t, k).cast<float>()));
  append_bytes(bytes, std::uint16_t{0});
}

}  // namespace

void write_stl(const SurfaceMesh& mesh, const std::string& title,
               const std::filesystem::path& path) {
  // Readers take a header that begins with "solid" for text STL.
  std::string bytes = std::string(title.starts_with("solid") ? " " : "") + title;
  bytes.resize(kStlHeader, ' ');
  bytes.reserve(kStlHeader + 4 + kStlTriangle * static_cast<std::size_t>(mesh.triangle_count()));
  append_bytes(bytes, static_cast<std::uint32_t>(mesh.triangle_count()));
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) append_stl_triangle(bytes, mesh, t);
  write_whole_file(path, bytes);
}

}  // namespace lensforge
