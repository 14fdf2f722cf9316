// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/cut_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string>
#include <utility>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

HeightField inspect_height_field(const SurfaceMesh& mesh, const Eigen::Vector2d& size) {
  if (const auto fault = height_field_fault(mesh, size)) throw InputError("surface: " + *fault);
  HeightField field;
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d a = mesh.corner(t, 0);
    const Eigen::Vector3d b = mesh.corner(t, 1);
    const Eigen::Vector3d c = mesh.corner(t, 2);
    for (const Eigen::Vector3d& corner : {a, b, c}) field.box.extend(corner);
    const Eigen::Vector3d normal = area_normal(mesh, t);
    if (normal.isZero(0.0)) continue;
    const double slope = normal.head<2>().norm() / normal.z();
    if (slope > field.steepest) {
      field.steepest = slope;
      field.steepest_place = (a + b + c) / 3.0;
    }
  }
  return field;
}

namespace {

template <class Action>
void for_each_cell(const Eigen::Vector2i& low, const Eigen::Vector2i& high, int columns,
                   const Action& action) {
  for (int row = low.y(); row <= high.y(); ++row) {
    for (int column = low.x(); column <= high.x(); ++column) {
      action(static_cast<std::size_t>(std::int64_t{row} * columns + column));
    }
  }
}

}  // namespace

FacetGrid::FacetGrid(const SurfaceMesh& mesh) : mesh_(mesh) {
  LF_CHECK(mesh.triangle_count() > 0, std::to_string(mesh.triangle_count()));
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) box_.extend(box_of(t));
  const double side =
      std::max(std::sqrt(2.0 * box_.volume() / static_cast<double>(mesh.triangle_count())),
               box_.sizes().maxCoeff() / 1e6);
  cells_ = (box_.sizes() / side).array().ceil().cast<int>().max(1);
  begin_.assign(static_cast<std::size_t>(std::int64_t{cells_.x()} * cells_.y()) + 1, 0);
  const auto for_each = [&](const auto& action) {
    for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
      const Eigen::AlignedBox2d box = box_of(t);
      for_each_cell(cell_at(box.min()), cell_at(box.max()), cells_.x(),
                    [&](std::size_t cell) { action(cell, static_cast<std::int32_t>(t)); });
    }
  };
  for_each([&](std::size_t cell, std::int32_t) { ++begin_[cell + 1]; });
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  triangles_.resize(static_cast<std::size_t>(begin_.back()));
  std::vector<std::int64_t> next(begin_.begin(), begin_.end() - 1);
  for_each([&](std::size_t cell, std::int32_t t) {
    triangles_[static_cast<std::size_t>(next[cell]++)] = t;
  });
}

Eigen::AlignedBox2d FacetGrid::box_of(std::int64_t triangle) const {
  Eigen::AlignedBox2d box;
  for (int k = 0; k < 3; ++k) box.extend(Eigen::Vector2d(mesh_.corner(triangle, k).head<2>()));
  const Eigen::Vector2d rim(kRim, kRim);
  return {box.min() - rim, box.max() + rim};
}

Eigen::Vector2i FacetGrid::cell_at(const Eigen::Vector2d& xy) const {
  const Eigen::Array2d share = (xy - box_.min()).array() / box_.sizes().array();
  const Eigen::Array2d cell = (share * cells_.array().cast<double>()).floor();
  return cell.max(0.0).min(cells_.array().cast<double>() - 1.0).cast<int>();
}

std::vector<std::int32_t> FacetGrid::near(const Eigen::AlignedBox2d& box) const {
  std::vector<std::int32_t> found;
  for_each_cell(cell_at(box.min()), cell_at(box.max()), cells_.x(), [&](std::size_t cell) {
    found.insert(found.end(), triangles_.begin() + begin_[cell],
                 triangles_.begin() + begin_[cell + 1]);
  });
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::erase_if(found, [&](std::int32_t t) { return !box_of(t).intersects(box); });
  return found;
}

namespace {

/// Facets are included this far beyond the ball, mm: rounding.
constexpr double kWindowMargin = 1e-6;

/// Interpolation error of a triangle per 1/mm of curvature, before it is split.
struct Interpolation {
  double height = 0.0;  ///< mm² · bend
  double slope = 0.0;   ///< mm · bend
};

Interpolation interpolation_of(const SurfaceMesh& mesh, std::int64_t triangle) {
  std::array<double, 3> side{};
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d way = mesh.corner(triangle, (k + 1) % 3) - mesh.corner(triangle, k);
    side[static_cast<std::size_t>(k)] = way.head<2>().norm();
  }
  std::sort(side.begin(), side.end());
  const double area = std::abs(mesh.plan_area(triangle));
  const bool obtuse = side[0] * side[0] + side[1] * side[1] <= side[2] * side[2];
  const double around = obtuse ? 0.5 * side[2] : side[0] * side[1] * side[2] / (4.0 * area);
  const double inscribed = 2.0 * area / (side[0] + side[1] + side[2]);
  return {0.5 * around * around, side[2] * side[1] * (side[0] + 4.0 * inscribed) / (4.0 * area)};
}

SurfaceBounds bounds_of(const OpticalSurface& surface, std::int64_t triangle) {
  SurfaceBounds bounds{surface.bend_range(triangle), HUGE_VAL, -HUGE_VAL};
  for (int k = 0; k < 3; ++k) {
    // In the middle of the third that lies at the edge across from corner k.
    Eigen::Vector3d weights = Eigen::Vector3d::Constant(4.0 / 9.0);
    weights[k] = 1.0 / 9.0;
    const SmoothPatch patch = surface.patch_in(triangle, weights);
    bounds.lowest = std::min(bounds.lowest, patch.lowest());
    bounds.highest = std::max(bounds.highest, patch.highest());
  }
  return bounds;
}

int splits_for(const Interpolation& shape, double bend, const SmoothCutOptions& options) {
  const double needed = std::max(std::sqrt(bend * shape.height / options.deviation),
                                 bend * shape.slope / options.slope_deviation);
  return static_cast<int>(std::clamp(std::ceil(needed), 1.0, double{kMaxSplits}));
}

/// The parts of one triangle that touch a window.
class TriangleParts {
 public:
  TriangleParts(const OpticalSurface& surface, std::int64_t triangle, int n,
                const Eigen::AlignedBox2d& window)
      : surface_(surface), triangle_(triangle), n_(n), window_(window) {
    for (int k = 0; k < 3; ++k) corner_.col(k) = surface.mesh().corner(triangle, k).head<2>();
  }

  /// Calls `emit` with the places (i, j) of the corners of each part: i steps towards the second
  /// corner, j towards the third.
  template <class Emit>
  void for_each(const Emit& emit) const {
    using Place = Eigen::Vector2i;
    for (int j = 0; j < n_; ++j) {
      for (int i = 0; i + j < n_; ++i) {
        offer({Place(i, j), Place(i + 1, j), Place(i, j + 1)}, emit);
        if (i + j + 1 < n_) offer({Place(i + 1, j), Place(i + 1, j + 1), Place(i, j + 1)}, emit);
      }
    }
  }

  template <class Visit>
  void for_each_point(const Visit& visit) const {
    for (int j = 0; j <= n_; ++j) {
      for (int i = 0; i + j <= n_; ++i) visit(Eigen::Vector2i(i, j));
    }
  }

  [[nodiscard]] std::int64_t point_count() const { return std::int64_t{n_ + 1} * (n_ + 2) / 2; }

  /// Number of a point in the order of for_each_point().
  [[nodiscard]] std::int64_t number(const Eigen::Vector2i& place) const {
    const std::int64_t j = place.y();
    return j * (n_ + 1) - j * (j - 1) / 2 + place.x();
  }

  [[nodiscard]] Eigen::Vector3d weights(const Eigen::Vector2i& place) const {
    return Eigen::Vector3d(n_ - place.x() - place.y(), place.x(), place.y()) / n_;
  }

  [[nodiscard]] Eigen::Vector3d point(const Eigen::Vector2i& place) const {
    const Eigen::Vector3d w = weights(place);
    const Eigen::Vector2d xy = corner_ * w;
    return {xy.x(), xy.y(), surface_.height_in(triangle_, w)};
  }

 private:
  template <class Emit>
  void offer(const std::array<Eigen::Vector2i, 3>& places, const Emit& emit) const {
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2i& place : places) {
      box.extend(Eigen::Vector2d(corner_ * weights(place)));
    }
    if (window_.intersects(box)) emit(places);
  }

  const OpticalSurface& surface_;
  std::int64_t triangle_;
  int n_;
  const Eigen::AlignedBox2d& window_;
  Eigen::Matrix<double, 2, 3> corner_;
};

Eigen::AlignedBox2d box_of(const SurfaceMesh& mesh, std::int64_t triangle) {
  Eigen::AlignedBox2d box;
  for (int k = 0; k < 3; ++k) box.extend(Eigen::Vector2d(mesh.corner(triangle, k).head<2>()));
  return box;
}

}  // namespace

std::shared_ptr<const SmoothCutSurface::Bent> SmoothCutSurface::bent(const OpticalSurface& surface,
                                                                     double radius,
                                                                     const Executor& executor) {
  const std::int64_t triangles = surface.mesh().triangle_count();
  std::vector<SurfaceBounds> bounds(static_cast<std::size_t>(triangles));
  std::vector<float> bends(bounds.size());
  parallel_for(executor, "smooth surface", triangles, [&](std::int64_t t) {
    const auto i = static_cast<std::size_t>(t);
    bounds[i] = bounds_of(surface, t);
    const BendRange& range = bounds[i].bend;
    bends[i] = float_above(std::max(std::abs(range.least), std::abs(range.largest)));
  });
  return std::make_shared<const Bent>(Bent{std::move(bends), SmoothBed(surface, radius, bounds)});
}

SmoothCutSurface::SmoothCutSurface(std::shared_ptr<const OpticalSurface> surface, double radius,
                                   const SmoothCutOptions& options, const Executor& executor)
    : surface_(std::move(surface)),
      grid_(surface_->mesh()),
      radius_(radius),
      bent_(bent(*surface_, radius, executor)) {
  split(options, executor);
}

SmoothCutSurface::SmoothCutSurface(const SmoothCutSurface& same, const SmoothCutOptions& options,
                                   const Executor& executor)
    : surface_(same.surface_), grid_(same.grid_), radius_(same.radius_), bent_(same.bent_) {
  split(options, executor);
}

/// Determines the number of parts of every triangle.
void SmoothCutSurface::split(const SmoothCutOptions& options, const Executor& executor) {
  const SurfaceMesh& mesh = surface_->mesh();
  splits_.resize(bent_->bends.size());
  std::vector<SurfaceDeviation> off(splits_.size());
  parallel_for(executor, "split surface", mesh.triangle_count(), [&](std::int64_t t) {
    const auto i = static_cast<std::size_t>(t);
    const Interpolation shape = interpolation_of(mesh, t);
    const double bend = bent_->bends[i];
    const int n = splits_for(shape, bend, options);
    splits_[i] = static_cast<std::uint8_t>(n);
    off[i] = {bend * shape.height / (n * n), bend * shape.slope / n};
  });
  for (const SurfaceDeviation& one : off) {
    deviation_.height = std::max(deviation_.height, one.height);
    deviation_.slope = std::max(deviation_.slope, one.slope);
  }
  const double area = surface_->box().volume();
  const double longest = surface_->box().sizes().maxCoeff();
  const double per_band = static_cast<double>(facet_count()) / area * longest;
  band_ = static_cast<double>(options.facets_at_once) / per_band - 2.0 * radius_;
}

std::int64_t SmoothCutSurface::facet_count() const {
  std::int64_t count = 0;
  for (const std::uint8_t n : splits_) count += std::int64_t{n} * n;
  return count;
}

SurfaceMesh SmoothCutSurface::facets(const Eigen::AlignedBox2d& window,
                                     const Executor& executor) const {
  const SurfaceMesh& mesh = surface_->mesh();
  std::vector<std::int32_t> triangles = grid_.near(window);
  std::erase_if(triangles, [&](std::int32_t t) { return !window.intersects(box_of(mesh, t)); });
  // Facets and points before each triangle; neighbours have separate points along their common
  // edge.
  std::vector<std::int64_t> begin(triangles.size() + 1, 0);
  std::vector<std::int64_t> points(triangles.size() + 1, 0);
  const auto parts_of = [&](std::int64_t i) {
    const std::int32_t t = triangles[static_cast<std::size_t>(i)];
    return TriangleParts(*surface_, t, splits_[static_cast<std::size_t>(t)], window);
  };
  const auto count = static_cast<std::int64_t>(triangles.size());
  constexpr std::int64_t kGrain = 16;
  const auto count_parts = [&](std::int64_t i) {
    const TriangleParts parts = parts_of(i);
    std::int64_t& facets = begin[static_cast<std::size_t>(i) + 1];
    parts.for_each([&](const auto& /*places*/) { ++facets; });
    points[static_cast<std::size_t>(i) + 1] = facets > 0 ? parts.point_count() : 0;
  };
  parallel_for(executor, "count facets", count, count_parts, kGrain);
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::partial_sum(points.begin(), points.end(), points.begin());

  SurfaceMesh fine;
  fine.triangles.resize(3, begin.back());
  fine.vertices.resize(3, points.back());
  const auto make_parts = [&](std::int64_t i) {
    const TriangleParts parts = parts_of(i);
    const std::int64_t first = points[static_cast<std::size_t>(i)];
    if (points[static_cast<std::size_t>(i) + 1] == first) return;
    parts.for_each_point([&](const Eigen::Vector2i& place) {
      fine.vertices.col(first + parts.number(place)) = parts.point(place);
    });
    std::int64_t facet = begin[static_cast<std::size_t>(i)];
    parts.for_each([&](const auto& places) {
      for (int k = 0; k < 3; ++k) {
        fine.triangles(k, facet) =
            static_cast<int>(first + parts.number(places[static_cast<std::size_t>(k)]));
      }
      ++facet;
    });
  };
  parallel_for(executor, "make facets", count, make_parts, kGrain);
  return fine;
}

std::shared_ptr<const DropCutter> SmoothCutSurface::cutter(const Eigen::AlignedBox2d& axis,
                                                           const Executor& executor) const {
  const Eigen::Vector2d around = Eigen::Vector2d::Constant(radius_ + kWindowMargin);
  const Eigen::AlignedBox2d window(Eigen::Vector2d(axis.min() - around),
                                   Eigen::Vector2d(axis.max() + around));
  return std::make_shared<const DropCutter>(facets(window, executor), radius_, executor);
}

}  // namespace lensforge
