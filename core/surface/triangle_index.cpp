// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/triangle_index.h"

#include <cmath>
#include <cstddef>
#include <numeric>

#include "core/surface/corners.h"

namespace lensforge {
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

}  // namespace lensforge
