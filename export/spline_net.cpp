// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/spline_net.h"

#include <algorithm>
#include <cmath>

#include "export/cubic_spline.h"

namespace lensforge {
namespace {

/// Integral over [0, cells] of every basis function.
Eigen::VectorXd basis_integrals(int cells) {
  Eigen::VectorXd integrals(cells + 3);
  for (int i = 0; i < integrals.size(); ++i) {
    // A quarter of its support's length.
    const int from = std::max(i - 3, 0);
    const int to = std::min(i + 1, cells);
    integrals[i] = 0.25 * (to - from);
  }
  return integrals;
}

double angle_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector3d m = Eigen::Vector3d(-a.x(), -a.y(), 1.0).normalized();
  const Eigen::Vector3d n = Eigen::Vector3d(-b.x(), -b.y(), 1.0).normalized();
  return 2.0 * std::asin(std::min(1.0, 0.5 * (m - n).norm()));
}

/// Points on one row of cells: heights and slopes of a patch, one row per x.
struct Strip {
  std::vector<double> u;
  std::vector<double> v;
  Eigen::MatrixXd z, zx, zy;
};

std::vector<double> raster(int from_cell, int to_cell, int density) {
  std::vector<double> points;
  for (int i = from_cell * density; i <= to_cell * density; ++i) {
    points.push_back(static_cast<double>(i) / density);
  }
  return points;
}

Strip evaluate_strip(const SplinePatch& patch, int cell, int density) {
  Strip strip{raster(cell, cell + 1, density), raster(0, patch.cells, density), {}, {}, {}};
  const Eigen::Vector2d cell_size = patch.box.sizes() / patch.cells;
  const auto across = basis_matrix(strip.v, patch.cells, false);
  const Eigen::MatrixXd rows = basis_matrix(strip.u, patch.cells, false) * patch.heights;
  const Eigen::MatrixXd row_slopes = basis_matrix(strip.u, patch.cells, true) * patch.heights;
  strip.z = rows * across.transpose();
  strip.zx = row_slopes * across.transpose() / cell_size.x();
  strip.zy = rows * basis_matrix(strip.v, patch.cells, true).transpose() / cell_size.y();
  return strip;
}

int interval_of(const std::vector<double>& lines, double at) {
  const auto above = std::upper_bound(lines.begin(), lines.end(), at);
  const auto count = static_cast<int>(lines.size()) - 1;
  return std::clamp(static_cast<int>(above - lines.begin()) - 1, 0, count - 1);
}

}  // namespace

SurfacePoint SplinePatch::at(const Eigen::Vector2d& xy) const {
  const Eigen::Array2d share = (xy - box.min()).array() / box.sizes().array();
  const Eigen::Array2d t = (share * cells).max(0.0).min(cells);
  const CubicBasis u = cubic_basis(t.x(), cells);
  const CubicBasis v = cubic_basis(t.y(), cells);
  SurfacePoint point;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      const double c = heights(u.first + static_cast<int>(i), v.first + static_cast<int>(j));
      point.z += c * u.value[i] * v.value[j];
      point.slope += c * Eigen::Vector2d(u.slope[i] * v.value[j], u.value[i] * v.slope[j]);
    }
  }
  point.slope = (point.slope.array() * cells / box.sizes().array()).matrix();
  return point;
}

double SplinePatch::volume() const {
  const Eigen::VectorXd weights = basis_integrals(cells);
  return weights.dot(heights * weights) * box.volume() / (double{1} * cells * cells);
}

FitError SplineNet::error() const {
  const double area = (x.back() - x.front()) * (y.back() - y.front());
  FitError worst;
  for (const SplinePatch& patch : patches) {
    worst.height = std::max(worst.height, patch.error.height);
    worst.normal = std::max(worst.normal, patch.error.normal);
    const double share = patch.box.volume() / area;
    worst.height_rms += share * patch.error.height_rms * patch.error.height_rms;
    worst.normal_rms += share * patch.error.normal_rms * patch.error.normal_rms;
  }
  worst.height_rms = std::sqrt(worst.height_rms);
  worst.normal_rms = std::sqrt(worst.normal_rms);
  return worst;
}

double SplineNet::volume() const {
  double sum = 0.0;
  for (const SplinePatch& patch : patches) sum += patch.volume();
  return sum;
}

std::int64_t SplineNet::control_points() const {
  std::int64_t count = 0;
  for (const SplinePatch& patch : patches) count += patch.heights.size();
  return count;
}

int SplineNet::patch_at(const Eigen::Vector2d& xy) const {
  return interval_of(y, xy.y()) * columns + interval_of(x, xy.x());
}

SurfacePoint SplineNet::at(const Eigen::Vector2d& xy) const {
  return patches[static_cast<std::size_t>(patch_at(xy))].at(xy);
}

SurfaceMesh sampled(const SplineNet& net, const GridShape& shape) {
  SurfaceMesh mesh;
  mesh.grid = shape;
  mesh.vertices.resize(3, Eigen::Index{shape.columns} * shape.rows);
  mesh.triangles.resize(3, Eigen::Index{2} * (shape.columns - 1) * (shape.rows - 1));
  const Eigen::Vector2d low(net.x.front(), net.y.front());
  const Eigen::Vector2d size = Eigen::Vector2d(net.x.back(), net.y.back()) - low;
  Eigen::Index t = 0;
  for (int r = 0; r < shape.rows; ++r) {
    for (int c = 0; c < shape.columns; ++c) {
      const Eigen::Array2d share(static_cast<double>(c) / (shape.columns - 1),
                                 static_cast<double>(r) / (shape.rows - 1));
      const Eigen::Vector2d xy = low + (share * size.array()).matrix();
      const int v = r * shape.columns + c;
      mesh.vertices.col(v) << xy, net.at(xy).z;
      if (c + 1 == shape.columns || r + 1 == shape.rows) continue;
      mesh.triangles.col(t++) << v, v + 1, v + shape.columns + 1;
      mesh.triangles.col(t++) << v, v + shape.columns + 1, v + shape.columns;
    }
  }
  return mesh;
}

FitError difference(const SurfacePoint& a, const SurfacePoint& b) {
  return {.height = std::abs(a.z - b.z), .normal = angle_between(a.slope, b.slope)};
}

bool holds(const FitError& error, const FitOptions& options) {
  return error.height <= options.tolerance && error.normal <= options.normal_tolerance;
}

FitError measure_patch(const SplinePatch& patch, const SmoothSurface& surface, int density) {
  FitError error;
  double points = 0.0;
  for (int cell = 0; cell < patch.cells; ++cell) {
    const Strip strip = evaluate_strip(patch, cell, density);
    for (Eigen::Index i = 0; i < strip.z.rows(); ++i) {
      for (Eigen::Index j = 0; j < strip.z.cols(); ++j) {
        const Eigen::Array2d share(strip.u[static_cast<std::size_t>(i)],
                                   strip.v[static_cast<std::size_t>(j)]);
        const Eigen::Vector2d step = (share / patch.cells * patch.box.sizes().array()).matrix();
        const auto point = surface.model_at(patch.box.min() + step);
        if (!point) continue;
        const FitError found =
            difference({strip.z(i, j), {strip.zx(i, j), strip.zy(i, j)}}, *point);
        error.height = std::max(error.height, found.height);
        error.normal = std::max(error.normal, found.normal);
        error.height_rms += found.height * found.height;
        error.normal_rms += found.normal * found.normal;
        points += 1.0;
      }
    }
  }
  error.height_rms = std::sqrt(error.height_rms / std::max(points, 1.0));
  error.normal_rms = std::sqrt(error.normal_rms / std::max(points, 1.0));
  return error;
}

}  // namespace lensforge
