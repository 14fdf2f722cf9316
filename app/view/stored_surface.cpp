// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/stored_surface.h"

#include <algorithm>
#include <cmath>

#include "core/page/html_text.h"
#include "core/page/script_data.h"
#include "core/surface/grid_mesh.h"
#include "core/surface/grid_triangles.h"

namespace lensforge {
namespace {

/// Of a place. On a grid it is an offset of a few cells: 100 mm of 640 cells are off by 10 nm.
constexpr int kPlaceBytes = 2;
/// Of a place on a mesh that is no grid.
constexpr int kFreePlaceBytes = 3;
/// Heights make the facets' slopes: 16 bits would move their light by tenths of a pixel.
constexpr int kHeightBytes = 3;
/// A slope of 0.3 is off by 5 µrad, which moves its light by less than 1 µm at 300 mm.
constexpr int kSlopeBytes = 2;

/// Numbers no farther apart, mm, are the same: x and y of an even grid differ by rounding.
constexpr double kSame = 1e-9;

/// Packs one number of every vertex, counted from `base`, and puts what is read back into its
/// place.
template <class Row, class Base>
StoredChannel pack(const std::string& name, int bytes, Row row, const Base& base) {
  StoredChannel channel{name, bytes, 0.0, 0.0, {}};
  for (Eigen::Index v = 0; v < row.size(); ++v) {
    const double value = row[v] - base(v);
    channel.low = v == 0 ? value : std::min(channel.low, value);
    channel.high = v == 0 ? value : std::max(channel.high, value);
  }
  if (channel.high - channel.low < kSame) {
    channel.bytes = 0;
    return channel;
  }
  PackedNumbers numbers(bytes);
  for (Eigen::Index v = 0; v < row.size(); ++v) {
    row[v] = base(v) + numbers.add(row[v] - base(v), channel.low, channel.high);
  }
  channel.text = numbers.text();
  return channel;
}

void add_places(StoredSurface& stored, const Eigen::Vector2d& lens_size) {
  SurfaceMesh& mesh = stored.read_back.mesh;
  const GridShape& grid = mesh.grid;
  for (int axis = 0; axis < 2; ++axis) {
    const auto even = [&](Eigen::Index v) {
      if (!grid.is_grid()) return 0.0;
      const Eigen::Index at = axis == 0 ? v % grid.columns : v / grid.columns;
      const int cells = (axis == 0 ? grid.columns : grid.rows) - 1;
      return lens_size[axis] * static_cast<double>(at) / cells;
    };
    const int bytes = grid.is_grid() ? kPlaceBytes : kFreePlaceBytes;
    stored.channels.push_back(pack(axis == 0 ? "x" : "y", bytes, mesh.vertices.row(axis), even));
  }
}

void add_slopes(StoredSurface& stored, const Eigen::Matrix3Xd& normals) {
  Eigen::Matrix3Xd& kept = stored.read_back.normals;
  kept = -normals.cwiseQuotient(normals.row(2).replicate(3, 1));
  const auto zero = [](Eigen::Index) { return 0.0; };
  stored.channels.push_back(pack("slope_x", kSlopeBytes, kept.row(0), zero));
  stored.channels.push_back(pack("slope_y", kSlopeBytes, kept.row(1), zero));
  kept = -kept;
}

/// Vertex numbers as little-endian 32-bit numbers.
std::string packed_corners(const SurfaceMesh& mesh) {
  std::vector<unsigned char> bytes;
  for (const int number : mesh.triangles.reshaped()) {
    for (unsigned k = 0; k < 4; ++k) {
      bytes.push_back(static_cast<unsigned char>(static_cast<std::uint32_t>(number) >> (8U * k)));
    }
  }
  return base64(bytes);
}

/// Says how the triangles lie on the grid, or stores them.
void add_triangles(StoredSurface& stored, const SurfaceMesh& mesh) {
  if (mesh.grid.is_grid()) {
    if (mesh.triangles == grid_triangles(mesh.grid)) return;
    stored.zigzag = mesh.triangles == make_grid_mesh({1.0, 1.0}, mesh.grid, 0.0).triangles;
  }
  if (!stored.zigzag) stored.corners = packed_corners(mesh);
}

}  // namespace

double StoredChannel::step() const {
  return bytes == 0 ? 0.0 : (high - low) / (std::ldexp(1.0, 8 * bytes) - 1.0);
}

const StoredChannel* StoredSurface::channel(const std::string& name) const {
  const auto found = std::find_if(channels.begin(), channels.end(),
                                  [&](const StoredChannel& c) { return c.name == name; });
  return found == channels.end() ? nullptr : &*found;
}

StoredSurface store_surface(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                            const Eigen::Vector2d& lens_size) {
  StoredSurface stored;
  stored.grid = mesh.grid;
  stored.vertices = mesh.vertex_count();
  stored.triangles = mesh.triangle_count();
  stored.read_back.mesh = mesh;
  add_places(stored, lens_size);
  const auto zero = [](Eigen::Index) { return 0.0; };
  stored.channels.push_back(pack("z", kHeightBytes, stored.read_back.mesh.vertices.row(2), zero));
  if (normals.cols() > 0) add_slopes(stored, normals);
  add_triangles(stored, mesh);
  return stored;
}

}  // namespace lensforge
