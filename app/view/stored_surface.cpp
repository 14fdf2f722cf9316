// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/stored_surface.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/error.h"
#include "core/page/html_page.h"
#include "core/spline/control_net.h"

namespace lensforge {
namespace {

constexpr double kMaxSteps = 16777215.0;  // 2^24 − 1
/// Spread of slopes caused by rounding heights, in pixels of the picture: it changes the MAE of a
/// 64² portrait's part by less than 1e-4.
constexpr double kSlopeShare = 0.008;
/// Step of stored slopes, in pixels.
constexpr double kStoredSlope = 0.01;
/// Numbers no farther apart, mm, are the same: x and y of an even grid differ by rounding.
constexpr double kSame = 1e-9;

/// Slope that moves light by about a pixel of the picture.
double pixel_slope(const OpticalSetup& setup) {
  const Eigen::Vector2d pixel = setup.image_size.cwiseQuotient(setup.pixels.cast<double>());
  return pixel.minCoeff() / std::abs(setup.focal_length);
}

/// Step of the coordinates of points `apart` mm from each other.
double place_step(const OpticalSetup& setup, double apart) {
  return kSlopeShare * pixel_slope(setup) * apart;
}

/// The values' differences of second order along a line of `count` values, `stride` apart.
/// Unsigned numbers wrap, so that every line can be read back.
void difference(std::vector<std::uint32_t>& numbers, std::size_t first, std::size_t count,
                std::size_t stride) {
  for (std::size_t i = count; i-- > 1;) {
    const std::size_t at = first + i * stride;
    numbers[at] -= 2 * numbers[at - stride];
    if (i > 1) numbers[at] += numbers[at - 2 * stride];
  }
}

/// Small numbers of either sign as small ones: 0, −1, 1, −2, …
std::uint32_t folded(std::uint32_t number) {
  return (number << 1U) ^ ((number >> 31U) != 0 ? ~std::uint32_t{0} : std::uint32_t{0});
}

std::string compressed(const std::vector<unsigned char>& bytes) {
  uLongf size = compressBound(bytes.size());
  std::vector<unsigned char> packed(size);
  if (compress2(packed.data(), &size, bytes.data(), bytes.size(), Z_BEST_COMPRESSION) != Z_OK) {
    throw RunError("a surface cannot be compressed: out of memory");
  }
  packed.resize(size);
  return base64(packed);
}

/// All lowest bytes first, then the next ones: the higher ones are mostly 0.
std::string packed_text(std::vector<std::uint32_t> numbers, std::size_t columns) {
  const std::size_t rows = numbers.size() / columns;
  for (std::size_t row = 0; row < rows; ++row) difference(numbers, row * columns, columns, 1);
  for (std::size_t column = 0; column < columns; ++column) {
    difference(numbers, column, rows, columns);
  }
  std::vector<unsigned char> bytes;
  bytes.reserve(sizeof(std::uint32_t) * numbers.size());
  for (std::size_t plane = 0; plane < sizeof(std::uint32_t); ++plane) {
    for (const std::uint32_t number : numbers) {
      bytes.push_back(static_cast<unsigned char>(folded(number) >> (8U * plane)));
    }
  }
  return compressed(bytes);
}

}  // namespace

StoredChannel store_numbers(const std::string& name, std::span<double> values, int columns,
                            double step) {
  const auto wide = static_cast<std::size_t>(columns);
  StoredChannel channel{name, columns, static_cast<int>(values.size() / wide), 0.0, step, ""};
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  channel.low = *low;
  const double range = *high - *low;
  if (range < kSame) {
    channel.step = 0.0;
    std::fill(values.begin(), values.end(), channel.low);
    return channel;
  }
  channel.step = std::max(step, range / kMaxSteps);
  std::vector<std::uint32_t> numbers;
  numbers.reserve(values.size());
  for (double& value : values) {
    const double steps = std::round((value - channel.low) / channel.step);
    numbers.push_back(static_cast<std::uint32_t>(steps));
    value = channel.low + channel.step * steps;
  }
  channel.text = packed_text(std::move(numbers), wide);
  return channel;
}

const StoredChannel* StoredSurface::channel(const std::string& name) const {
  const auto found = std::find_if(channels.begin(), channels.end(),
                                  [&](const StoredChannel& c) { return c.name == name; });
  return found == channels.end() ? nullptr : &*found;
}

namespace {

/// Adds a row of numbers as a channel, relative to `base`, and replaces it by what is read back.
template <class Row, class Base>
void add(StoredSurface& stored, const std::string& name, int columns, double step, Row row,
         const Base& base) {
  std::vector<double> values(static_cast<std::size_t>(row.size()));
  for (Eigen::Index v = 0; v < row.size(); ++v) {
    values[static_cast<std::size_t>(v)] = row[v] - base(v);
  }
  stored.channels.push_back(store_numbers(name, values, columns, step));
  for (Eigen::Index v = 0; v < row.size(); ++v) {
    row[v] = base(v) + values[static_cast<std::size_t>(v)];
  }
}

double zero(Eigen::Index) { return 0.0; }

void add_places(StoredSurface& stored, const OpticalSetup& setup, int columns, double step) {
  SurfaceMesh& mesh = stored.read_back.mesh;
  const GridShape& grid = mesh.grid;
  for (int axis = 0; axis < 2; ++axis) {
    const auto even = [&](Eigen::Index v) {
      if (!grid.is_grid()) return 0.0;
      const Eigen::Index at = axis == 0 ? v % grid.columns : v / grid.columns;
      const int cells = (axis == 0 ? grid.columns : grid.rows) - 1;
      return setup.lens_size[axis] * static_cast<double>(at) / cells;
    };
    add(stored, axis == 0 ? "x" : "y", columns, step, mesh.vertices.row(axis), even);
  }
}

void add_slopes(StoredSurface& stored, const Eigen::Matrix3Xd& normals, int columns, double step) {
  Eigen::Matrix3Xd& kept = stored.read_back.normals;
  kept = -normals.cwiseQuotient(normals.row(2).replicate(3, 1));
  add(stored, "slope_x", columns, step, kept.row(0), zero);
  add(stored, "slope_y", columns, step, kept.row(1), zero);
  kept = -kept;
}

/// Records the grid's triangulation, or stores the triangles.
void add_triangles(StoredSurface& stored, const SurfaceMesh& mesh) {
  if (mesh.grid.is_grid()) {
    if (mesh.triangles == grid_triangles(mesh.grid)) return;
    stored.zigzag = mesh.triangles == make_grid_mesh({1.0, 1.0}, mesh.grid, 0.0).triangles;
    if (stored.zigzag) return;
  }
  const auto corners = mesh.triangles.reshaped();
  std::vector<double> numbers(corners.begin(), corners.end());
  stored.channels.push_back(
      store_numbers("corners", numbers, static_cast<int>(numbers.size()), 1.0));
}

}  // namespace

StoredSurface store_surface(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                            const OpticalSetup& setup) {
  StoredSurface stored;
  stored.grid = mesh.grid;
  stored.vertices = mesh.vertex_count();
  stored.triangles = mesh.triangle_count();
  stored.read_back.mesh = mesh;
  const int columns = mesh.grid.is_grid() ? mesh.grid.columns : static_cast<int>(stored.vertices);
  const double apart = std::sqrt(setup.lens_size.prod() /
                                 std::max<double>(1.0, static_cast<double>(stored.vertices)));
  const double step = place_step(setup, apart);
  add_places(stored, setup, columns, step);
  add(stored, "z", columns, step, stored.read_back.mesh.vertices.row(2), zero);
  if (normals.cols() > 0) {
    add_slopes(stored, normals, columns, kStoredSlope * pixel_slope(setup));
  }
  add_triangles(stored, mesh);
  return stored;
}

StoredSurface store_spline(ControlNet net, int samples, const OpticalSetup& setup) {
  StoredSurface stored;
  stored.spline = true;
  stored.samples = samples;
  const Eigen::Vector2i cells = net.cells();
  const double step =
      place_step(setup, setup.lens_size.cwiseQuotient(cells.cast<double>()).minCoeff());
  const auto even = [&](int axis) {
    return [&, axis](Eigen::Index v) {
      const Eigen::Index at = axis == 0 ? v % net.shape.columns : v / net.shape.columns;
      return setup.lens_size[axis] * greville_point(static_cast<int>(at), cells[axis]) /
             cells[axis];
    };
  };
  add(stored, "x", net.shape.columns, step, net.points.row(0), even(0));
  add(stored, "y", net.shape.columns, step, net.points.row(1), even(1));
  add(stored, "z", net.shape.columns, step, net.points.row(2), zero);
  stored.read_back = spline_nodes(net, samples);
  const SurfaceMesh& mesh = stored.read_back.mesh;
  stored.grid = mesh.grid;
  stored.vertices = mesh.vertex_count();
  stored.triangles = mesh.triangle_count();
  stored.zigzag = mesh.triangles != grid_triangles(mesh.grid);
  return stored;
}

}  // namespace lensforge
