// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/designed_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Nodes along either side of the blocks that are filled together.
constexpr std::int64_t kBlockSide = 64;

/// Nodes this far outside of a facet, as a share of its height over an edge, count as on it, so
/// that no gap opens between neighbours.
constexpr double kOnFacet = 1e-9;

/// One facet seen from above.
struct Facet {
  Eigen::Vector3d corner;                ///< The first.
  Eigen::Vector2d slope;                 ///< ∂z/∂x, ∂z/∂y
  Eigen::Vector2d low, high;             ///< Box.
  Eigen::Matrix<double, 3, 2> gradient;  ///< Of the barycentric coordinates.

  Facet(const SurfaceMesh& mesh, std::int32_t triangle) : corner(mesh.corner(triangle, 0)) {
    const Eigen::Vector3d b = mesh.corner(triangle, 1);
    const Eigen::Vector3d c = mesh.corner(triangle, 2);
    const Eigen::Vector3d u = b - corner;
    const Eigen::Vector3d v = c - corner;
    const Eigen::Vector3d normal = area_normal(mesh, triangle);
    slope = -normal.head<2>() / normal.z();
    low = corner.cwiseMin(b).cwiseMin(c).head<2>();
    high = corner.cwiseMax(b).cwiseMax(c).head<2>();
    gradient.row(1) = Eigen::RowVector2d(v.y(), -v.x()) / normal.z();
    gradient.row(2) = Eigen::RowVector2d(-u.y(), u.x()) / normal.z();
    gradient.row(0) = -gradient.row(1) - gradient.row(2);
  }

  [[nodiscard]] Eigen::Vector3d barycentric(double x, double y) const {
    Eigen::Vector3d at = gradient * Eigen::Vector2d(x - corner.x(), y - corner.y());
    at[0] += 1.0;
    return at;
  }

  [[nodiscard]] double height(double x, double y) const {
    return corner.z() + slope.x() * (x - corner.x()) + slope.y() * (y - corner.y());
  }

  /// Maximum distance of a point beyond the line through an edge, mm; ≤ 0 inside.
  [[nodiscard]] double outside(double x, double y) const {
    const Eigen::Vector3d at = barycentric(x, y);
    return (-at.array() / gradient.rowwise().norm().array()).maxCoeff();
  }
};

/// First and last node of a row of `count` nodes in from … to, by their coordinate.
template <class Coordinate>
std::pair<std::int64_t, std::int64_t> nodes_between(const Coordinate& at, double spacing,
                                                    std::int64_t begin, std::int64_t end,
                                                    std::pair<double, double> range) {
  const auto guess = [&](double x) {
    const double k = std::clamp((x - at(begin)) / spacing, -1.0, static_cast<double>(end - begin));
    return begin + static_cast<std::int64_t>(std::floor(k));
  };
  return {std::max(begin, guess(range.first) - 1), std::min(end, guess(range.second) + 2)};
}

/// A block of a window's nodes: columns and rows [begin, end).
struct NodeBlock {
  std::int64_t column, column_end, row, row_end;
};

/// The facet itself as a surface.
struct FlatFacet {
  const Facet& facet;

  [[nodiscard]] SurfacePoint operator()(const Eigen::Vector2d& q) const {
    return {facet.height(q.x(), q.y()), facet.slope};
  }
};

/// A surface without creases over a facet; makes its cubics on demand.
class SmoothFacet {
 public:
  SmoothFacet(const OpticalSurface& surface, const Facet& facet, std::int32_t triangle)
      : surface_(surface), facet_(facet), triangle_(triangle) {
    for (int k = 0; k < 3; ++k) corners_.col(k) = surface.mesh().corner(triangle, k).head<2>();
  }

  /// Beside the facet: on the tangent plane at about the nearest point of its rim.
  [[nodiscard]] SurfacePoint operator()(const Eigen::Vector2d& q) {
    Eigen::Vector3d weights = facet_.barycentric(q.x(), q.y()).cwiseMax(0.0);
    weights /= weights.sum();
    const Eigen::Vector2d at = corners_ * weights;
    int third = 0;
    if (surface_.has_thirds()) weights.minCoeff(&third);
    const SurfaceShape shape = patch(third).at(at);
    return {shape.z + shape.slope.dot(q - at), shape.slope};
  }

 private:
  /// The cubic for points whose weight of `corner` is smallest, determined at the middle of its
  /// third.
  [[nodiscard]] const SmoothPatch& patch(int corner) {
    std::optional<SmoothPatch>& patch = patches_[static_cast<std::size_t>(corner)];
    if (!patch) {
      Eigen::Vector3d middle = Eigen::Vector3d::Constant(4.0 / 9.0);
      middle[corner] = 1.0 / 9.0;
      patch = surface_.patch_in(triangle_, middle);
    }
    return *patch;
  }

  const OpticalSurface& surface_;
  const Facet& facet_;
  std::int32_t triangle_;
  Eigen::Matrix<double, 2, 3> corners_;
  std::array<std::optional<SmoothPatch>, 3> patches_;
};

/// Finds the facet of every node of a block and the point over it: `surface(facet, triangle)`
/// returns a functor that gives the points of a facet.
template <class Surface>
class BlockFiller {
 public:
  BlockFiller(const FacetGrid& grid, const Surface& surface, const NodeBlock& block,
              SurfacePatch& patch)
      : grid_(grid), surface_(surface), block_(block), patch_(patch) {}

  void fill() {
    const GridWindow& window = patch_.window;
    for (std::int64_t j = block_.row; j < block_.row_end; ++j) {
      for (std::int64_t i = block_.column; i < block_.column_end; ++i) patch_.cut[node(i, j)] = -1;
    }
    const Eigen::AlignedBox2d box(window.node(block_.column, block_.row),
                                  window.node(block_.column_end - 1, block_.row_end - 1));
    const std::vector<std::int32_t> near = grid_.near(box);
    for (const std::int32_t t : near) fill_facet(t);
    for (std::int64_t j = block_.row; j < block_.row_end; ++j) {
      for (std::int64_t i = block_.column; i < block_.column_end; ++i) {
        if (patch_.cut[node(i, j)] < 0) fill_beside(near, i, j);
      }
    }
  }

 private:
  [[nodiscard]] std::size_t node(std::int64_t i, std::int64_t j) const {
    return static_cast<std::size_t>(j * patch_.window.columns + i);
  }

  template <class Points>
  void put(Points& points, std::int32_t triangle, std::int64_t i, std::int64_t j) {
    const std::size_t n = node(i, j);
    const SurfacePoint point = points(patch_.window.node(i, j));
    patch_.z[n] = point.z;
    patch_.slope_x[n] = point.slope.x();
    patch_.slope_y[n] = point.slope.y();
    patch_.cut[n] = triangle;
  }

  void fill_facet(std::int32_t triangle) {
    const GridWindow& window = patch_.window;
    const Facet facet(grid_.mesh(), triangle);
    auto points = surface_(facet, triangle);
    const auto [row, row_end] =
        nodes_between([&](std::int64_t j) { return window.y(j); }, window.spacing.y(), block_.row,
                      block_.row_end, {facet.low.y(), facet.high.y()});
    const auto [column, column_end] =
        nodes_between([&](std::int64_t i) { return window.x(i); }, window.spacing.x(),
                      block_.column, block_.column_end, {facet.low.x(), facet.high.x()});
    for (std::int64_t j = row; j < row_end; ++j) {
      for (std::int64_t i = column; i < column_end; ++i) {
        if (patch_.cut[node(i, j)] >= 0) continue;
        if (facet.barycentric(window.x(i), window.y(j)).minCoeff() < -kOnFacet) continue;
        put(points, triangle, i, j);
      }
    }
  }

  void fill_beside(const std::vector<std::int32_t>& near, std::int64_t i, std::int64_t j) {
    const Eigen::Vector2d q = patch_.window.node(i, j);
    double nearest = FacetGrid::kRim;
    for (const std::int32_t t : near) {
      const Facet facet(grid_.mesh(), t);
      const double outside = facet.outside(q.x(), q.y());
      if (outside >= nearest) continue;
      nearest = outside;
      auto points = surface_(facet, t);
      put(points, t, i, j);
    }
    if (patch_.cut[node(i, j)] >= 0) return;
    throw InputError("surface: nothing at x " + decimal_text(q.x(), 3) + " y " +
                     decimal_text(q.y(), 3) + " mm; it must cover the whole lens");
  }

  const FacetGrid& grid_;
  const Surface& surface_;
  NodeBlock block_;
  SurfacePatch& patch_;
};

template <class Surface>
void fill_window(const FacetGrid& grid, const Surface& surface, const Executor& executor,
                 SurfacePatch& patch) {
  const GridWindow& window = patch.window;
  const std::int64_t across = (window.columns + kBlockSide - 1) / kBlockSide;
  const std::int64_t blocks = across * ((window.rows + kBlockSide - 1) / kBlockSide);
  const auto fill = [&](std::int64_t b) {
    const std::int64_t column = b % across * kBlockSide;
    const std::int64_t row = b / across * kBlockSide;
    BlockFiller(grid, surface,
                {column, std::min(window.columns, column + kBlockSide), row,
                 std::min(window.rows, row + kBlockSide)},
                patch)
        .fill();
  };
  parallel_for(executor, "designed surface", blocks, fill, 1);
}

}  // namespace

void FacetField::sample(const GridWindow& window, const Executor& executor,
                        SurfacePatch& patch) const {
  resize_patch(window, true, patch);
  const auto points = [](const Facet& facet, std::int32_t /*triangle*/) {
    return FlatFacet{facet};
  };
  fill_window(grid_, points, executor, patch);
}

void SmoothField::sample(const GridWindow& window, const Executor& executor,
                         SurfacePatch& patch) const {
  resize_patch(window, true, patch);
  const auto points = [this](const Facet& facet, std::int32_t triangle) {
    return SmoothFacet(surface_, facet, triangle);
  };
  fill_window(grid_, points, executor, patch);
  patch.cut.clear();
}

}  // namespace lensforge
