// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/lens_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/optics/light_path.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Maximum distance of the surface's rim from the lens's, share of the lens's larger side: a design
/// keeps its rim to double precision, other programs to single (6e-8).
constexpr double kRimShare = 1e-4;

std::optional<std::string> extent_fault(const SurfaceMesh& mesh, const Eigen::Vector2d& size) {
  const double tolerance = kRimShare * size.maxCoeff();
  for (int axis = 0; axis < 2; ++axis) {
    const double low = mesh.vertices.row(axis).minCoeff();
    const double high = mesh.vertices.row(axis).maxCoeff();
    if (std::abs(low) <= tolerance && std::abs(high - size[axis]) <= tolerance) continue;
    return std::string(axis == 0 ? "x" : "y") + " runs from " + number_text(low) + " to " +
           number_text(high) + " mm: by lens_size it must run from 0 to " + number_text(size[axis]);
  }
  return std::nullopt;
}

/// A triangle's grid cell and the corner of the cell that it leaves out; −1 if it is not half of a
/// cell.
struct HalfCell {
  std::int64_t cell = -1;
  std::size_t left_out = 0;  ///< 0, 1 lower left and right, 2, 3 upper left and right.
};

HalfCell half_cell(const SurfaceMesh& mesh, const GridShape& shape, std::int64_t triangle) {
  const Eigen::Vector3i v = mesh.triangles.col(triangle);
  const Eigen::Vector3i row = v / shape.columns;
  const Eigen::Vector3i column = v - row * shape.columns;
  const Eigen::Vector2i low(column.minCoeff(), row.minCoeff());
  if (column.maxCoeff() != low.x() + 1 || row.maxCoeff() != low.y() + 1) return {};
  std::array<bool, 4> has{};
  for (int k = 0; k < 3; ++k) {
    has[static_cast<std::size_t>(column[k] - low.x() + 2 * (row[k] - low.y()))] = true;
  }
  if (std::count(has.begin(), has.end(), true) != 3) return {};
  return {std::int64_t{low.y()} * (shape.columns - 1) + low.x(),
          static_cast<std::size_t>(std::find(has.begin(), has.end(), false) - has.begin())};
}

}  // namespace

std::optional<std::string> surface_fault(const SurfaceMesh& mesh, const OpticalSetup& setup) {
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    if (mesh.plan_area(t) > 0.0) continue;
    return "triangle " + std::to_string(t) +
           " must run counter-clockwise seen from +z, but covers " +
           number_text(mesh.plan_area(t)) + " mm^2";
  }
  const double lowest = mesh.vertices.row(2).minCoeff();
  const double highest = mesh.vertices.row(2).maxCoeff();
  const LightPath light(setup);
  const auto vertices = mesh.vertices.colwise();
  const bool before_screen = std::all_of(vertices.begin(), vertices.end(),
                                         [&](const auto& p) { return light.before_screen(p); });
  if (!(lowest >= 0.0 && before_screen)) {
    return "z runs from " + number_text(lowest) + " to " + number_text(highest) +
           " mm: must be between the entry face at 0 and the receiving plane" +
           (setup.screen_is_turned() ? "" : " at " + number_text(setup.focal_length));
  }
  return extent_fault(mesh, setup.lens_size);
}

std::optional<std::string> grid_fault(const SurfaceMesh& mesh, const GridShape& shape) {
  const std::int64_t cells = std::int64_t{shape.columns - 1} * (shape.rows - 1);
  if (mesh.triangle_count() != 2 * cells) {
    return "the surface has " + std::to_string(mesh.triangle_count()) +
           " triangles, the grid calls for " + std::to_string(2 * cells);
  }
  constexpr std::size_t kNone = 4;
  constexpr std::size_t kFull = 5;
  std::vector<std::size_t> left_out(static_cast<std::size_t>(cells), kNone);
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const HalfCell half = half_cell(mesh, shape, t);
    if (half.cell < 0)
      return "the surface's triangle " + std::to_string(t) + " is no half of a cell of the grid";
    std::size_t& other = left_out[static_cast<std::size_t>(half.cell)];
    // The halves of a cell leave out opposite corners: 0 and 3, or 1 and 2.
    if (other != kNone && other + half.left_out != 3) {
      return "the surface's triangle " + std::to_string(t) + " overlaps another one in its cell";
    }
    other = other == kNone ? half.left_out : kFull;
  }
  return std::nullopt;
}

}  // namespace lensforge
