// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/mould.h"

#include <string>

#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

void validate(const MouldOptions& options) {
  if (!(options.shrinkage >= 0.0 && options.shrinkage <= kMaxShrinkage)) {
    throw InputError("mould shrinkage: " + decimal_text(options.shrinkage, 6) +
                     ": must be in 0 to 0.2, as a share of the size");
  }
  if (!(options.thickness > 0.0 && options.thickness <= 1000.0)) {
    throw InputError("mould thickness: " + decimal_text(options.thickness, 3) +
                     ": must be above 0 and at most 1000 mm");
  }
}

/// New number of a vertex: turning over reverses the rows of a grid.
std::int64_t turned(const GridShape& grid, std::int64_t vertex) {
  if (!grid.is_grid()) return vertex;
  const std::int64_t column = vertex % grid.columns;
  return vertex - column + (grid.columns - 1 - column);
}

}  // namespace

SurfaceMesh mould_surface(const SurfaceMesh& lens, const MouldOptions& options) {
  validate(options);
  SurfaceMesh mould;
  mould.grid = lens.grid;
  mould.vertices.resize(3, lens.vertex_count());
  mould.triangles.resize(3, lens.triangle_count());
  if (lens.vertex_count() == 0) return mould;
  const double scale = 1.0 / (1.0 - options.shrinkage);
  const double width = lens.vertices.row(0).maxCoeff();
  const double top = lens.vertices.row(2).maxCoeff();
  for (std::int64_t v = 0; v < lens.vertex_count(); ++v) {
    const Eigen::Vector3d at = lens.vertices.col(v);
    mould.vertices.col(turned(lens.grid, v)) =
        scale * Eigen::Vector3d(width - at.x(), at.y(), top - at.z()) +
        Eigen::Vector3d(0.0, 0.0, options.thickness);
  }
  // A rotation keeps the triangles' sense; the mould is the other side of the same surface.
  for (std::int64_t t = 0; t < lens.triangle_count(); ++t) {
    for (int k = 0; k < 3; ++k) {
      mould.triangles(2 - k, t) = static_cast<int>(turned(lens.grid, lens.triangles(k, t)));
    }
  }
  return mould;
}

}  // namespace lensforge
