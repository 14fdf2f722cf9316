// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/mesh_files.h"

#include <array>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "core/error.h"
#include "core/io/files.h"
#include "core/mesh/mesh_readers.h"
#include "core/mesh/surface_mesh.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

// Records are copied from memory unchanged.
static_assert(std::endian::native == std::endian::little, "files are written little-endian");

/// Maximum size of another program's file: its content is held in memory. A binary STL of this size
/// has 85 million triangles.
constexpr std::uintmax_t kMaxMeshBytes = std::uintmax_t{4} << 30U;

constexpr std::size_t kPlyTriangleBytes = 1 + 3 * sizeof(std::int32_t);

struct Counts {
  std::int64_t vertices = 0;
  std::int64_t triangles = 0;
};

constexpr std::string_view kFormatLines = "ply\nformat binary_little_endian 1.0\n";
/// Precedes the version of the program that wrote the file.
constexpr std::string_view kMarkBegin = "comment lensforge ";
/// Maximum bytes of a mark line.
constexpr std::size_t kLongestMark = 100;

constexpr std::string_view kNormalLines =
    "property double nx\nproperty double ny\nproperty double nz\n";

/// The header lines after the format and the mark.
std::string element_lines(const Counts& counts, std::string_view normals = "") {
  return "element vertex " + std::to_string(counts.vertices) +
         "\nproperty double x\nproperty double y\nproperty double z\n" + std::string(normals) +
         "element face " + std::to_string(counts.triangles) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

std::int64_t number_after(const std::string& text, const std::string& words) {
  std::int64_t number = -1;
  if (const auto at = text.find(words); at != std::string::npos) {
    std::from_chars(text.data() + at + words.size(), text.data() + text.size(), number);
  }
  return number;
}

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

/// The header of a file in our own form.
struct OwnHeader {
  Counts counts;
  bool normals = false;  ///< Every vertex is followed by its normal.
  std::size_t bytes = 0;

  [[nodiscard]] Eigen::Index numbers_per_vertex() const { return normals ? 6 : 3; }
};

/// The header if the file has exactly the form of write_ply(), with or without its mark.
std::optional<OwnHeader> own_form(std::ifstream& file) {
  const std::size_t longest = kFormatLines.size() + kLongestMark +
                              element_lines({INT32_MAX, INT32_MAX}, kNormalLines).size();
  std::string head(longest, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  file.clear();
  if (!head.starts_with(kFormatLines)) return std::nullopt;
  std::size_t begin = kFormatLines.size();
  if (head.compare(begin, kMarkBegin.size(), kMarkBegin) == 0) begin = head.find('\n', begin) + 1;
  const Counts counts{number_after(head, "\nelement vertex "),
                      number_after(head, "\nelement face ")};
  if (counts.vertices < 0 || counts.vertices > INT32_MAX) return std::nullopt;
  if (counts.triangles < 0 || counts.triangles > INT32_MAX) return std::nullopt;
  for (const bool normals : {false, true}) {
    const std::string lines = element_lines(counts, normals ? kNormalLines : "");
    if (head.compare(begin, lines.size(), lines) != 0) continue;
    file.seekg(static_cast<std::streamoff>(begin + lines.size()));
    return OwnHeader{counts, normals, begin + lines.size()};
  }
  return std::nullopt;
}

/// Reads our own form exactly, without rounding to single precision.
SurfaceMesh read_own_form(std::ifstream& file, const OwnHeader& header, const fs::path& path) {
  const Counts& counts = header.counts;
  const std::uintmax_t expected =
      header.bytes +
      static_cast<std::uintmax_t>(counts.vertices * header.numbers_per_vertex()) * sizeof(double) +
      static_cast<std::uintmax_t>(counts.triangles) * kPlyTriangleBytes;
  if (const std::uintmax_t size = fs::file_size(path); size != expected) {
    refuse(path, "is " + std::to_string(size) + " bytes long, its header calls for " +
                     std::to_string(expected) + ": it is truncated or corrupt");
  }
  SurfaceMesh mesh;
  mesh.triangles.resize(3, counts.triangles);
  Eigen::MatrixXd records(header.numbers_per_vertex(), counts.vertices);
  file.read(reinterpret_cast<char*>(records.data()),
            records.size() * std::streamsize{sizeof(double)});
  mesh.vertices = records.topRows<3>();
  std::array<char, kPlyTriangleBytes> record{};
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    file.read(record.data(), kPlyTriangleBytes);
    if (record[0] != 3) refuse(path, "face " + std::to_string(t) + " is no triangle");
    std::memcpy(mesh.triangles.col(t).data(), &record[1], kPlyTriangleBytes - 1);
  }
  if (!file) refuse(path, "cannot be read to its end");
  return mesh;
}

/// The extension without its dot, in small letters.
std::string format_of(const fs::path& path) {
  return lower_case(path.extension().string().erase(0, 1));
}

SurfaceMesh read_foreign(const fs::path& path) {
  const std::string format = format_of(path);
  const std::string name = path.string();
  const std::string content = read_whole_file(path, kMaxMeshBytes);
  if (format == "ply") return read_ply(content, name);
  if (format == "obj") return read_obj(content, name);
  if (format == "off") return read_off(content, name);
  if (format == "stl") return read_stl(content, name);
  refuse(path, "extension '" + path.extension().string() +
                   "' is not that of a mesh: .ply, .obj, .stl and .off are read");
}

void check_mesh(const SurfaceMesh& mesh, const fs::path& path) {
  if (mesh.triangle_count() == 0) refuse(path, "holds no triangles");
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    if (mesh.vertices.col(v).allFinite()) continue;
    const auto text = [&](int axis) { return number_text(mesh.vertices(axis, v)); };
    refuse(path, "vertex " + std::to_string(v) + " is at (" + text(0) + ", " + text(1) + ", " +
                     text(2) + "): coordinates must be finite");
  }
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    for (const int v : mesh.triangles.col(t)) {
      if (v >= 0 && v < mesh.vertices.cols()) continue;
      refuse(path, "triangle " + std::to_string(t) + " uses vertex " + std::to_string(v) +
                       ": there are only 0 ... " + std::to_string(mesh.vertices.cols() - 1));
    }
  }
}

/// Vertices in turn, each followed by its normal.
Eigen::MatrixXd with_normals(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals) {
  Eigen::MatrixXd records(6, mesh.vertex_count());
  records.topRows<3>() = mesh.vertices;
  records.bottomRows<3>() = normals.colwise().normalized();
  return records;
}

/// @param records  the stored data of the vertices, one column each.
template <class Matrix>
void write_blocks(const SurfaceMesh& mesh, const Matrix& records, std::ofstream& file) {
  const std::string_view normals = records.rows() > 3 ? kNormalLines : "";
  file << kFormatLines << "comment " << program_mark() << '\n'
       << element_lines({mesh.vertex_count(), mesh.triangle_count()}, normals);
  file.write(reinterpret_cast<const char*>(records.data()),
             records.size() * std::streamsize{sizeof(double)});
  std::array<char, kPlyTriangleBytes> record{3};
  for (Eigen::Index t = 0; t < mesh.triangles.cols() && file; ++t) {
    std::memcpy(&record[1], mesh.triangles.col(t).data(), kPlyTriangleBytes - 1);
    file.write(record.data(), kPlyTriangleBytes);
  }
  file.flush();
}

template <class Matrix>
void write_records(const SurfaceMesh& mesh, const Matrix& records, const fs::path& path) {
  static_assert(sizeof(int) == sizeof(std::int32_t));
  write_whole_file(path, [&](const fs::path& beside) {
    errno = 0;
    std::ofstream file(beside, std::ios::binary | std::ios::trunc);
    write_blocks(mesh, records, file);
    if (file) return;
    throw RunError(path.string() + ": cannot be written: " +
                   (errno != 0 ? system_reason(errno) : "unknown reason"));
  });
}

}  // namespace

SurfaceMesh read_mesh(const fs::path& path) {
  std::ifstream file = open_input(path);
  if (file.peek() == std::ifstream::traits_type::eof()) refuse(path, "is empty");
  const std::optional<OwnHeader> own = own_form(file);
  SurfaceMesh mesh = own ? read_own_form(file, *own, path) : read_foreign(path);
  check_mesh(mesh, path);
  return mesh;
}

void write_ply(const SurfaceMesh& mesh, const fs::path& path) {
  write_records(mesh, mesh.vertices, path);
}

void write_ply(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals, const fs::path& path) {
  write_records(mesh, with_normals(mesh, normals), path);
}

namespace {

constexpr std::size_t kStlHeaderBytes = 80;
constexpr std::size_t kStlTriangleBytes = 12 * sizeof(float) + sizeof(std::uint16_t);

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
  bytes.resize(kStlHeaderBytes, ' ');
  bytes.reserve(kStlHeaderBytes + 4 +
                kStlTriangleBytes * static_cast<std::size_t>(mesh.triangle_count()));
  append_bytes(bytes, static_cast<std::uint32_t>(mesh.triangle_count()));
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) append_stl_triangle(bytes, mesh, t);
  write_whole_file(path, bytes);
}

}  // namespace lensforge
