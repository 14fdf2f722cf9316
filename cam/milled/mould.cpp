// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/mould.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <variant>

#include "core/error.h"
#include "core/lens/continued_surface.h"
#include "core/lens/lens.h"
#include "core/spline/control_net.h"
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

/// New number of a vertex: turning the lens over reverses the rows of a grid.
std::int64_t turned(const GridShape& grid, std::int64_t vertex) {
  if (!grid.is_grid()) return vertex;
  const std::int64_t column = vertex % grid.columns;
  return vertex - column + (grid.columns - 1 - column);
}

/// Points of a lens on its mould, those of a grid in the grid's new order.
Eigen::Matrix3Xd turned_over(const Eigen::Matrix3Xd& points, const GridShape& grid,
                             const Eigen::Vector2d& corner, const MouldOptions& options) {
  const double scale = 1.0 / (1.0 - options.shrinkage);
  Eigen::Matrix3Xd result(3, points.cols());
  for (Eigen::Index v = 0; v < points.cols(); ++v) {
    const Eigen::Vector3d at = points.col(v);
    result.col(turned(grid, v)) =
        scale * Eigen::Vector3d(corner.x() - at.x(), at.y(), corner.y() - at.z()) +
        Eigen::Vector3d(0.0, 0.0, options.thickness);
  }
  return result;
}

/// Right side and top of a lens, which become left and bottom of its mould.
Eigen::Vector2d far_corner(const SurfaceMesh& lens) {
  return {lens.vertices.row(0).maxCoeff(), lens.vertices.row(2).maxCoeff()};
}

}  // namespace

SurfaceMesh mould_surface(const SurfaceMesh& lens, const MouldOptions& options) {
  validate(options);
  SurfaceMesh mould;
  mould.grid = lens.grid;
  mould.triangles.resize(3, lens.triangle_count());
  if (lens.vertex_count() == 0) return mould;
  mould.vertices = turned_over(lens.vertices, lens.grid, far_corner(lens), options);
  // A rotation keeps the triangles' orientation; the mould is the other side of the same surface.
  for (std::int64_t t = 0; t < lens.triangle_count(); ++t) {
    for (int k = 0; k < 3; ++k) {
      mould.triangles(2 - k, t) = static_cast<int>(turned(lens.grid, lens.triangles(k, t)));
    }
  }
  return mould;
}

Lens mould_lens(const Lens& lens, const MouldOptions& options) {
  Lens mould = lens;
  mould.surface = mould_surface(lens.surface, options);
  if (lens.spline) {
    mould.spline->points =
        turned_over(lens.spline->points, lens.spline->shape, far_corner(lens.surface), options);
  }
  return mould;
}

Lens front_lens(const Lens& lens, double top) {
  const auto& front = std::get<HeightFront>(lens.setup.front.value());
  ControlNet net = net_of(front);
  net.points = turned_over(net.points, net.shape, {front.size.x(), top}, {0.0, 0.0});
  Lens turned = lens;
  turned.setup.front.reset();
  turned.model = SurfaceModel::kSpline;
  turned.surface = spline_nodes(net, kMeshSamples).mesh;
  turned.spline = std::move(net);
  return turned;
}

namespace {

/// The mould's nodes under a window of the lens: mirrored along x, so that columns count down.
GridWindow under(const GridWindow& lens, const CastFrame& frame) {
  GridWindow mould = lens;
  mould.origin = frame.scale * Eigen::Vector2d(frame.width - lens.origin.x(), lens.origin.y());
  mould.spacing = frame.scale * lens.spacing;
  mould.first_column = -(lens.first_column + lens.columns - 1);
  return mould;
}

template <class Value>
void mirror_rows(const GridWindow& window, std::vector<Value>& values) {
  const auto columns = static_cast<std::ptrdiff_t>(window.columns);
  for (auto row = values.begin(); row != values.end(); row += columns) {
    std::reverse(row, row + columns);
  }
}

}  // namespace

void CastField::sample(const GridWindow& window, const Executor& executor,
                       SurfacePatch& patch) const {
  mould_.sample(under(window, frame_), executor, patch);
  patch.window = window;
  for (std::vector<double>* values :
       {&patch.z, &patch.slope_x, &patch.slope_y, &patch.depth, &patch.width}) {
    mirror_rows(window, *values);
  }
  mirror_rows(window, patch.cut);
  // z = top − (Z − thickness) / scale with X = scale (width − x), Y = scale y: the slope along x
  // changes its sign twice.
  for (double& z : patch.z) z = frame_.top - (z - frame_.thickness) / frame_.scale;
  for (double& slope : patch.slope_y) slope = -slope;
  for (double& depth : patch.depth) depth /= frame_.scale;
  for (double& width : patch.width) width /= frame_.scale;
}

}  // namespace lensforge
