// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/optical_surface.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/lens/smooth_surface.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {
namespace {

// Notation: s, t barycentric coordinates of corners 1 and 2; x, y from corner 0 on, mm.

/// Coefficients of 1, s, t, s², st, t², s³, s²t, st², t³: differences of the Bernstein
/// coefficients.
std::array<double, 10> in_weights(const SmoothPatch::Coefficients& b) {
  const auto [b300, b030, b003, b210, b120, b201, b021, b111, b102, b012] = b;
  const double ss = b120 - 2.0 * b210 + b300;
  const double tt = b102 - 2.0 * b201 + b300;
  const double st = b111 - b210 - b201 + b300;
  return {b300,
          3.0 * (b210 - b300),
          3.0 * (b201 - b300),
          3.0 * ss,
          6.0 * st,
          3.0 * tt,
          b030 - 3.0 * b120 + 3.0 * b210 - b300,
          3.0 * (b021 - 2.0 * b111 + b201 - ss),
          3.0 * (b012 - 2.0 * b111 + b210 - tt),
          b003 - 3.0 * b102 + 3.0 * b201 - b300};
}

}  // namespace

SmoothPatch::SmoothPatch(const std::array<Eigen::Vector2d, 3>& corners,
                         const Coefficients& coefficients)
    : origin_(corners[0]),
      lowest_(*std::min_element(coefficients.begin(), coefficients.end())),
      highest_(*std::max_element(coefficients.begin(), coefficients.end())) {
  Eigen::Matrix2d frame;
  frame << corners[1] - corners[0], corners[2] - corners[0];
  to_weights_ = frame.inverse();
  const auto [c, cs, ct, css, cst, ctt, csss, csst, cstt, cttt] = in_weights(coefficients);
  // s = a x + b y, t = d x + e y
  const double a = to_weights_(0, 0);
  const double b = to_weights_(0, 1);
  const double d = to_weights_(1, 0);
  const double e = to_weights_(1, 1);
  power_ = {c,
            cs * a + ct * d,
            cs * b + ct * e,
            css * a * a + cst * a * d + ctt * d * d,
            2.0 * css * a * b + cst * (a * e + b * d) + 2.0 * ctt * d * e,
            css * b * b + cst * b * e + ctt * e * e,
            csss * a * a * a + csst * a * a * d + cstt * a * d * d + cttt * d * d * d,
            3.0 * csss * a * a * b + csst * (a * a * e + 2.0 * a * b * d) +
                cstt * (2.0 * a * d * e + b * d * d) + 3.0 * cttt * d * d * e,
            3.0 * csss * a * b * b + csst * (b * b * d + 2.0 * a * b * e) +
                cstt * (2.0 * b * d * e + a * e * e) + 3.0 * cttt * d * e * e,
            csss * b * b * b + csst * b * b * e + cstt * b * e * e + cttt * e * e * e};
}

SmoothPatch cubic_through(const std::array<Eigen::Vector2d, 3>& corners,
                          const std::array<SurfacePoint, 3>& points, double middle) {
  const auto toward = [&](std::size_t i, std::size_t j) {
    return points[i].z + points[i].slope.dot(corners[j] - corners[i]) / 3.0;
  };
  SmoothPatch::Coefficients c{points[0].z,  points[1].z,  points[2].z, toward(0, 1), toward(1, 0),
                              toward(0, 2), toward(1, 2), 0.0,         toward(2, 0), toward(2, 1)};
  // In the middle a corner weighs 1/27, a coefficient on an edge 3/27, the inner one 6/27.
  const double at_corners = c[0] + c[1] + c[2];
  const double on_edges = c[3] + c[4] + c[5] + c[6] + c[8] + c[9];
  c[7] = (27.0 * middle - at_corners - 3.0 * on_edges) / 6.0;
  return {corners, c};
}

SurfaceShape SmoothPatch::at(const Eigen::Vector2d& xy) const {
  const double x = xy.x() - origin_.x();
  const double y = xy.y() - origin_.y();
  const auto& [c, cx, cy, cxx, cxy, cyy, cxxx, cxxy, cxyy, cyyy] = power_;
  const double row0 = c + x * (cx + x * (cxx + x * cxxx));
  const double row1 = cy + x * (cxy + x * cxxy);
  const double row2 = cyy + x * cxyy;
  SurfaceShape shape;
  shape.z = row0 + y * (row1 + y * (row2 + y * cyyy));
  shape.slope.x() = cx + x * (2.0 * cxx + 3.0 * x * cxxx) + y * (cxy + 2.0 * x * cxxy + y * cxyy);
  shape.slope.y() = row1 + y * (2.0 * row2 + 3.0 * y * cyyy);
  const double mixed = cxy + 2.0 * (x * cxxy + y * cxyy);
  shape.bend << 2.0 * (cxx + 3.0 * x * cxxx + y * cxxy), mixed, mixed,
      2.0 * (row2 + 3.0 * y * cyyy);
  return shape;
}

namespace {

/// Barycentric tolerance for points outside the mesh.
constexpr double kOnMesh = 1e-9;

}  // namespace

TriangleIndex::TriangleIndex(const SurfaceMesh& mesh) {
  const auto xy = mesh.vertices.topRows<2>();
  box_ = {Eigen::Vector2d(xy.rowwise().minCoeff()), Eigen::Vector2d(xy.rowwise().maxCoeff())};
  const double side = std::sqrt(2.0 * box_.volume() / static_cast<double>(mesh.triangle_count()));
  bins_ = (box_.sizes() / side).array().ceil().cast<int>().max(1);
  const auto for_each_bin = [&](Eigen::Index t, const auto& action) {
    Eigen::AlignedBox2d box;
    for (int k = 0; k < 3; ++k) box.extend(Eigen::Vector2d(mesh.corner(t, k).head<2>()));
    const Eigen::Vector2i low = bin_cell(box.min());
    const Eigen::Vector2i high = bin_cell(box.max());
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        action(static_cast<std::size_t>(std::int64_t{y} * bins_.x() + x));
      }
    }
  };
  bin_begin_.assign(static_cast<std::size_t>(bins_.prod()) + 1, 0);
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    for_each_bin(t, [&](std::size_t bin) { ++bin_begin_[bin + 1]; });
  }
  std::partial_sum(bin_begin_.begin(), bin_begin_.end(), bin_begin_.begin());
  bin_triangles_.resize(static_cast<std::size_t>(bin_begin_.back()));
  std::vector<std::int64_t> next(bin_begin_.begin(), bin_begin_.end() - 1);
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    for_each_bin(t, [&](std::size_t bin) {
      bin_triangles_[static_cast<std::size_t>(next[bin]++)] = static_cast<std::int32_t>(t);
    });
  }
}

Eigen::Vector2i TriangleIndex::bin_cell(const Eigen::Vector2d& xy) const {
  const Eigen::Array2d share = (xy - box_.min()).array() / box_.sizes().array();
  const Eigen::Array2i cell = (share * bins_.array().cast<double>()).floor().cast<int>();
  return cell.max(0).min(bins_.array() - 1);
}

std::int64_t TriangleIndex::bin_of(const Eigen::Vector2d& xy) const {
  const Eigen::Vector2i cell = bin_cell(xy);
  return std::int64_t{cell.y()} * bins_.x() + cell.x();
}

PlaceOnMesh TriangleIndex::locate(const SurfaceMesh& mesh, const Eigen::Vector2d& xy) const {
  PlaceOnMesh best;
  double best_least = -kOnMesh;
  const auto bin = static_cast<std::size_t>(bin_of(xy));
  for (std::int64_t i = bin_begin_[bin]; i < bin_begin_[bin + 1]; ++i) {
    const std::int32_t t = bin_triangles_[static_cast<std::size_t>(i)];
    const Eigen::Vector2d a = mesh.corner(t, 0).head<2>() - xy;
    const Eigen::Vector2d b = mesh.corner(t, 1).head<2>() - xy;
    const Eigen::Vector2d c = mesh.corner(t, 2).head<2>() - xy;
    Eigen::Vector3d weights(cross(b, c), cross(c, a), cross(a, b));
    weights /= weights.sum();
    const double least = weights.minCoeff();
    if (least < best_least) continue;
    best = {t, weights};
    best_least = least;
    if (least > 0.0) break;
  }
  return best;
}

OpticalSurface::OpticalSurface(SurfaceMesh mesh) : mesh_(std::move(mesh)), index_(mesh_) {}

std::optional<SurfacePoint> OpticalSurface::at(const Eigen::Vector2d& xy) const {
  const PlaceOnMesh place = locate(xy);
  if (place.triangle < 0) return std::nullopt;
  return in_triangle(place.triangle, place.weights);
}

std::optional<SmoothPatch> OpticalSurface::patch_at(const Eigen::Vector2d& xy) const {
  const PlaceOnMesh place = locate(xy);
  if (place.triangle < 0) return std::nullopt;
  return patch_in(place.triangle, place.weights);
}

std::shared_ptr<const OpticalSurface> optical_surface(const SurfaceMesh& mesh, SurfaceModel model) {
  switch (model) {
    case SurfaceModel::kFacet:
      return std::make_shared<const FacetSurface>(mesh);
    case SurfaceModel::kSmooth:
      break;
    case SurfaceModel::kSpline:
      LF_CHECK(false, "a mesh is no spline");
  }
  return std::make_shared<const SmoothSurface>(mesh);
}

SurfacePoint FacetSurface::in_triangle(std::int64_t triangle,
                                       const Eigen::Vector3d& weights) const {
  const Eigen::Vector3d normal = area_normal(mesh(), triangle);
  SurfacePoint point;
  for (int k = 0; k < 3; ++k) point.z += weights[k] * mesh().corner(triangle, k).z();
  point.slope = -normal.head<2>() / normal.z();
  return point;
}

/// The Bernstein coefficients of a plane are its heights at their domain points.
SmoothPatch FacetSurface::patch_in(std::int64_t triangle,
                                   const Eigen::Vector3d& /*weights*/) const {
  std::array<Eigen::Vector2d, 3> corners;
  std::array<double, 3> z{};
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d corner = mesh().corner(triangle, k);
    corners[static_cast<std::size_t>(k)] = corner.head<2>();
    z[static_cast<std::size_t>(k)] = corner.z();
  }
  const auto mean = [&](double a, double b, double c) {
    return (a * z[0] + b * z[1] + c * z[2]) / 3.0;
  };
  return {corners,
          {z[0], z[1], z[2], mean(2, 1, 0), mean(1, 2, 0), mean(2, 0, 1), mean(0, 2, 1),
           mean(1, 1, 1), mean(1, 0, 2), mean(0, 1, 2)}};
}

void BendRange::include(const Eigen::Matrix2d& bend) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
  solver.computeDirect(bend, Eigen::EigenvaluesOnly);
  least = std::min(least, solver.eigenvalues()[0]);
  largest = std::max(largest, solver.eigenvalues()[1]);
}

SplineSurface::SplineSurface(ControlNet net)
    : OpticalSurface(spline_nodes(net, kMeshSamples).mesh), net_(std::move(net)) {}

Eigen::Vector2d SplineSurface::node_parameters(int node) const {
  const int columns = mesh().grid.columns;
  return Eigen::Vector2d(node % columns, node / columns) / kMeshSamples;
}

SurfaceShape SplineSurface::shape_in(std::int64_t triangle, const Eigen::Vector3d& weights) const {
  Eigen::Vector2d xy(0.0, 0.0);
  Eigen::Vector2d start(0.0, 0.0);
  for (int k = 0; k < 3; ++k) {
    xy += weights[k] * mesh().corner(triangle, k).head<2>();
    start += weights[k] * node_parameters(mesh().triangles(k, triangle));
  }
  return net_.at(net_.parameters_of(xy, start)).shape();
}

SurfacePoint SplineSurface::in_triangle(std::int64_t triangle,
                                        const Eigen::Vector3d& weights) const {
  const SurfaceShape shape = shape_in(triangle, weights);
  return {shape.z, shape.slope};
}

SmoothPatch SplineSurface::patch_in(std::int64_t triangle,
                                    const Eigen::Vector3d& /*weights*/) const {
  std::array<Eigen::Vector2d, 3> p;
  std::array<SurfacePoint, 3> points;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    p[i] = mesh().corner(triangle, k).head<2>();
    const SurfaceShape shape = net_.at(node_parameters(mesh().triangles(k, triangle))).shape();
    points[i] = {shape.z, shape.slope};
  }
  return cubic_through(p, points, shape_in(triangle, Eigen::Vector3d::Constant(1.0 / 3.0)).z);
}

BendRange SplineSurface::bend_range(std::int64_t triangle) const {
  const SmoothPatch patch = patch_in(triangle, Eigen::Vector3d::Constant(1.0 / 3.0));
  BendRange range{HUGE_VAL, -HUGE_VAL};
  for (int k = 0; k < 3; ++k) {
    range.include(patch.at(mesh().corner(triangle, k).head<2>()).bend);
    range.include(net_.at(node_parameters(mesh().triangles(k, triangle))).shape().bend);
  }
  return range;
}

}  // namespace lensforge
