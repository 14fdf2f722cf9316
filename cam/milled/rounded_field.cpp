// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/milled/rounded_field.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cam/milled/ball_sweep.h"
#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {}  // namespace

FacetReach::FacetReach(const FacetGrid& grid, double radius, const Executor& executor)
    : radius_(radius) {
  const SurfaceMesh& mesh = grid.mesh();
  const std::int64_t count = mesh.triangle_count();
  planes_.resize(index_of(count));
  const auto make_plane = [&](std::int64_t t) {
    const Eigen::Vector3d normal = area_normal(mesh, t).normalized();
    planes_[index_of(t)] = {normal, normal.dot(mesh.corner(t, 0))};
  };
  parallel_for(executor, "facet planes", count, make_plane);
  std::vector<std::vector<std::int32_t>> found(index_of(count));
  const auto find = [&](std::int64_t t) {
    found[index_of(t)] = suspects_of(grid, static_cast<std::int32_t>(t));
  };
  parallel_for(executor, "facets in reach", count, find, 64);
  begin_.assign(1, 0);
  begin_.reserve(index_of(count) + 1);
  for (const auto& list : found) {
    begin_.push_back(begin_.back() + static_cast<std::int64_t>(list.size()));
  }
  suspects_.reserve(index_of(begin_.back()));
  for (const auto& list : found) suspects_.insert(suspects_.end(), list.begin(), list.end());
}

/// A ball tangent to facet f cuts no triangle below the plane of f, and none whose plane is at
/// least R from its centre; that distance is linear over the facet, so checking its corners is
/// enough.
std::vector<std::int32_t> FacetReach::suspects_of(const FacetGrid& grid, std::int32_t facet) const {
  const SurfaceMesh& mesh = grid.mesh();
  const Plane& plane = planes_[index_of(facet)];
  const double reach = radius_ * (1.0 + plane.normal.head<2>().norm());
  Eigen::AlignedBox2d box;
  for (int k = 0; k < 3; ++k) box.extend(Eigen::Vector2d(mesh.corner(facet, k).head<2>()));
  const Eigen::Vector2d around(reach, reach);
  std::vector<std::int32_t> suspects;
  for (const std::int32_t t : grid.near({box.min() - around, box.max() + around})) {
    if (t == facet) continue;
    const Plane& other = planes_[index_of(t)];
    double highest = -std::numeric_limits<double>::infinity();
    double nearest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      highest = std::max(highest, plane.normal.dot(mesh.corner(t, k)) - plane.level);
      const Eigen::Vector3d centre = mesh.corner(facet, k) + radius_ * plane.normal;
      nearest = std::min(nearest, other.normal.dot(centre) - other.level);
    }
    constexpr double kRounding = 1e-12;
    if (highest > kRounding && nearest < radius_ - kRounding) suspects.push_back(t);
  }
  return suspects;
}

bool FacetReach::surely_free(std::int32_t facet, const Eigen::Vector3d& centre) const {
  for (std::int64_t s = begin_[index_of(facet)]; s < begin_[index_of(facet) + 1]; ++s) {
    const Plane& other = planes_[index_of(suspects_[index_of(s)])];
    if (other.normal.dot(centre) - other.level < radius_) return false;
  }
  return true;
}

namespace {

/// Side of the cells, in radii.
constexpr double kIndexCellPerRadius = 0.25;

/// Maximum number of cells: 16 MB.
constexpr double kMaxIndexCells = 1.6e7;

/// Boxes exceed cells by this, mm: rounding of a centre's cell.
constexpr double kMargin = 1e-6;

}  // namespace

SmoothReach::SmoothReach(const SmoothBed& bed, const Executor& executor)
    : box_(bed.surface().box()) {
  const double radius = bed.radius();
  cell_ = std::max(kIndexCellPerRadius * radius, std::sqrt(box_.volume() / kMaxIndexCells));
  columns_ = static_cast<std::int64_t>(box_.sizes().x() / cell_) + 1;
  rows_ = static_cast<std::int64_t>(box_.sizes().y() / cell_) + 1;
  free_.resize(static_cast<std::size_t>(columns_ * rows_));
  const Eigen::Vector2d around = Eigen::Vector2d::Constant(kMargin);
  const auto judge = [&](std::int64_t i) {
    const std::int64_t row = i / columns_;
    const Eigen::Vector2d corner =
        box_.min() +
        cell_ * Eigen::Vector2d(static_cast<double>(i % columns_), static_cast<double>(row));
    const Eigen::AlignedBox2d under(
        Eigen::Vector2d(corner - around),
        Eigen::Vector2d(corner + Eigen::Vector2d::Constant(cell_) + around));
    const double bend = bed.bounds().over(bed.footprint(under)).bend.largest;
    free_[static_cast<std::size_t>(i)] = bend * radius < 1.0 ? 1 : 0;
  };
  parallel_for(executor, "reach of the ball", columns_ * rows_, judge);
}

/// A centre beyond the rim belongs to the outermost cell, whose box includes all of the surface
/// that its ball can touch.
std::int64_t SmoothReach::cell_of(double at, double begin, double cell, std::int64_t cells) {
  const double place = std::floor((at - begin) / cell);
  return static_cast<std::int64_t>(std::clamp(place, 0.0, static_cast<double>(cells - 1)));
}

namespace {

/// Maximum number of contacts kept, and of searches for another: 3 to 6 are usual on creased meshes
/// (RoundedField.EqualsTheBestOfManyBalls).
constexpr std::size_t kMaxPlanes = 8;
constexpr int kMaxDrops = 40;

/// The search ends when another step gains less than this, mm.
constexpr double kGain = 1e-10;

/// Valleys of two planes whose normals are closer than this, rad, have no reliable direction.
constexpr double kParallel = 1e-9;

/// Depth of a ball's centre below a plane at which it counts as on it, mm: rounding.
constexpr double kOnPlane = 1e-12;

/// The point of a triangle that is nearest to p.
Eigen::Vector3d nearest_point(const Eigen::Matrix3d& corners, const Eigen::Vector3d& p) {
  const Eigen::Vector3d normal =
      (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0));
  bool inside = normal.squaredNorm() > 0.0;
  Eigen::Vector3d best = corners.col(0);
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d a = corners.col(k);
    const Eigen::Vector3d edge = corners.col((k + 1) % 3) - a;
    inside = inside && normal.cross(edge).dot(p - a) >= 0.0;
    const double length2 = edge.squaredNorm();
    const double t = length2 > 0.0 ? std::clamp((p - a).dot(edge) / length2, 0.0, 1.0) : 0.0;
    const Eigen::Vector3d on_edge = a + t * edge;
    const double distance2 = (p - on_edge).squaredNorm();
    if (distance2 >= least) continue;
    least = distance2;
    best = on_edge;
  }
  if (!inside) return best;
  return p - normal * (normal.dot(p - corners.col(0)) / normal.squaredNorm());
}

/// n·c ≥ level: the condition of one contact on the ball's centre.
struct Plane {
  Eigen::Vector3d normal;
  double level = 0.0;
};

/// The triangles found so far, and the lowest ball over the planes that replace some of them.
class Contacts {
 public:
  Contacts(const DropCutter& cutter, const Eigen::Vector2d& q)
      : cutter_(cutter), q_(q), radius_(cutter.radius()) {}

  /// Adds a triangle, replacing the oldest if there are too many.
  void add(std::int32_t triangle) {
    for (std::size_t k = 0; k < size_; ++k) {
      if (triangles_[k] == triangle) return;
    }
    if (size_ < kMaxPlanes) {
      triangles_[size_++] = triangle;
    } else {
      std::rotate(triangles_.begin(), triangles_.begin() + 1, triangles_.end());
      triangles_.back() = triangle;
    }
  }

  /// Replaces every triangle by a plane, for balls near one that cuts none of them: its tangent
  /// plane if it touches the triangle, parallel to that if it does not. The distance from a
  /// triangle is convex in the centre, so a ball above these planes cuts into no triangle.
  void lay_planes(const Eigen::Vector3d& centre) {
    for (std::size_t k = 0; k < size_; ++k) {
      const Eigen::Vector3d touched = nearest_point(cutter_.corners(triangles_[k]), centre);
      planes_[k].normal = (centre - touched).normalized();
      planes_[k].level = planes_[k].normal.dot(touched) + radius_;
    }
  }

  /// The lowest ball among those that touch exactly one set of up to three planes and are not below
  /// another.
  [[nodiscard]] std::optional<LowestBall> lowest() const {
    std::optional<LowestBall> best;
    const auto offer = [&](const std::optional<LowestBall>& ball) {
      if (ball && (!best || ball->z < best->z) && allowed(ball->centre)) best = ball;
    };
    for (std::size_t a = 0; a < size_; ++a) {
      offer(on_plane(planes_[a]));
      for (std::size_t b = 0; b < a; ++b) {
        offer(in_valley(planes_[a], planes_[b]));
        for (std::size_t c = 0; c < b; ++c) offer(in_pit(planes_[a], planes_[b], planes_[c]));
      }
    }
    return best;
  }

 private:
  [[nodiscard]] bool allowed(const Eigen::Vector3d& centre) const {
    for (std::size_t k = 0; k < size_; ++k) {
      if (planes_[k].normal.dot(centre) < planes_[k].level - kOnPlane) return false;
    }
    return true;
  }

  [[nodiscard]] std::optional<LowestBall> on_plane(const Plane& plane) const {
    if (plane.normal.z() < kParallel) return std::nullopt;
    LowestBall ball;
    ball.z = (plane.level - radius_ - plane.normal.head<2>().dot(q_)) / plane.normal.z();
    ball.centre = Eigen::Vector3d(q_.x(), q_.y(), ball.z) + radius_ * plane.normal;
    return ball;
  }

  /// Both planes hold the ball: its centre is on a line a + t·d. The vertical through q is within R
  /// of the line above the lower of the two places at the distance R.
  [[nodiscard]] std::optional<LowestBall> in_valley(const Plane& first, const Plane& second) const {
    const Eigen::Vector3d across = first.normal.cross(second.normal);
    const double sine2 = across.squaredNorm();
    if (sine2 < kParallel * kParallel) return std::nullopt;
    const Eigen::Vector3d d = across / std::sqrt(sine2);
    const Eigen::Vector3d a =
        (first.level * second.normal.cross(across) + second.level * across.cross(first.normal)) /
        sine2;
    // |(q, z) − a|² minus its part along d is R²: a quadratic in z.
    const Eigen::Vector3d o(q_.x() - a.x(), q_.y() - a.y(), 0.0);
    const Eigen::Vector3d from = o - o.dot(d) * d;
    const Eigen::Vector3d up(-d.z() * d.x(), -d.z() * d.y(), 1.0 - d.z() * d.z());
    const double up2 = up.squaredNorm();
    const double half = from.dot(up);
    const double root2 = half * half - up2 * (from.squaredNorm() - radius_ * radius_);
    if (root2 < 0.0 || up2 < kParallel) return std::nullopt;
    const double height = -(half + std::sqrt(root2)) / up2;
    LowestBall ball;
    ball.z = a.z() + height;
    const Eigen::Vector3d place(o.x(), o.y(), height);
    ball.centre = a + place.dot(d) * d;
    ball.spread = radius_ * (first.normal - second.normal).norm();
    return ball;
  }

  [[nodiscard]] std::optional<LowestBall> in_pit(const Plane& first, const Plane& second,
                                                 const Plane& third) const {
    Eigen::Matrix3d normals;
    normals << first.normal.transpose(), second.normal.transpose(), third.normal.transpose();
    const double volume = normals.determinant();
    if (std::abs(volume) < kParallel) return std::nullopt;
    LowestBall ball;
    ball.centre = normals.inverse() * Eigen::Vector3d(first.level, second.level, third.level);
    const double room = radius_ * radius_ - (q_ - ball.centre.head<2>()).squaredNorm();
    if (room < 0.0) return std::nullopt;
    ball.z = ball.centre.z() - std::sqrt(room);
    ball.spread = radius_ * std::max({(first.normal - second.normal).norm(),
                                      (second.normal - third.normal).norm(),
                                      (third.normal - first.normal).norm()});
    return ball;
  }

  const DropCutter& cutter_;
  Eigen::Vector2d q_;
  double radius_;
  std::array<std::int32_t, kMaxPlanes> triangles_{};
  std::array<Plane, kMaxPlanes> planes_{};
  std::size_t size_ = 0;
};

/// The resting ball with the axis of `ball`.
LowestBall lifted(const LowestBall& ball, const Eigen::Vector2d& q, double radius, double tip) {
  LowestBall rest = ball;
  rest.centre.z() = std::max(ball.centre.z(), tip + radius);
  rest.z = ball_below(rest.centre, radius, q.x(), q.y());
  return rest;
}

}  // namespace

/// Steps from one resting ball to a lower one; if the next one cuts into an unknown triangle, that
/// is added.
LowestBall LowestBallSearch::over(const Eigen::Vector2d& q, const TangentPlane& plane,
                                  CutterLocation& near) const {
  const double radius = cutter_.radius();
  const Eigen::Vector3d normal =
      Eigen::Vector3d(-plane.slope.x(), -plane.slope.y(), 1.0).normalized();
  LowestBall tangent{plane.z, Eigen::Vector3d(q.x(), q.y(), plane.z) + radius * normal, 0.0};
  near = cutter_.drop(tangent.centre.head<2>(), near);
  if (!near.rests() || near.tip + radius <= tangent.centre.z() + resting_) return tangent;
  Contacts contacts(cutter_, q);
  LowestBall best = lifted(tangent, q, radius, near.tip);
  contacts.add(near.triangle);
  for (int k = 0; k < kMaxDrops; ++k) {
    contacts.lay_planes(best.centre);
    const std::optional<LowestBall> next = contacts.lowest();
    if (!next) return best;
    near = cutter_.drop(next->centre.head<2>(), near);
    if (!near.rests()) return best;
    const LowestBall rest = lifted(*next, q, radius, near.tip);
    const bool cuts = rest.centre.z() > next->centre.z() + resting_;
    const double gain = best.z - rest.z;
    if (gain >= 0.0) best = rest;
    if (!cuts && gain <= kGain) return best;
    contacts.add(near.triangle);
  }
  return best;
}

namespace {

/// Nodes of a row that are rounded one after the other; each starts from the location of the last.
constexpr std::int64_t kRun = 256;

TangentPlane plane_at(const SurfacePatch& patch, std::size_t node) {
  return {patch.z[node], {patch.slope_x[node], patch.slope_y[node]}};
}

}  // namespace

RoundedField::RoundedField(const SurfaceField& designed, const FacetGrid& grid,
                           const DropCutter& cutter, const Executor& executor)
    : designed_(designed),
      radius_(cutter.radius()),
      search_(LowestBallSearch(cutter)),
      reach_(FacetReach(grid, radius_, executor)) {}

RoundedField::RoundedField(const SurfaceField& designed, const CutSurface& cut, double error,
                           const Executor& executor)
    : designed_(designed), radius_(cut.radius()), error_(error), cut_(&cut) {
  if (cut.bed() != nullptr) smooth_reach_.emplace(*cut.bed(), executor);
}

void RoundedField::sample(const GridWindow& window, const Executor& executor,
                          SurfacePatch& patch) const {
  designed_.sample(window, executor, patch);
  patch.depth.assign(patch.z.size(), 0.0);
  patch.width.assign(patch.z.size(), 0.0);
  if (cut_ == nullptr) {
    round(*search_, {{0, window.columns}, {0, window.rows}}, executor, patch);
    return;
  }
  const std::vector<Range> squares = squares_of(window);
  const auto round_square = [&](std::int64_t i) { round_facets_of(squares[index_of(i)], patch); };
  parallel_for(executor, "rounded squares", std::ssize(squares), round_square, 1);
}

/// Squares of kPatch, counted from (0, 0).
std::vector<RoundedField::Range> RoundedField::squares_of(const GridWindow& window) {
  const auto parts = [](std::int64_t count, const auto& at) {
    std::vector<std::pair<std::int64_t, std::int64_t>> found;
    const auto square_of = [&](std::int64_t i) { return std::floor(at(i) / kPatch); };
    for (std::int64_t begin = 0; begin < count;) {
      std::int64_t end = begin + 1;
      while (end < count && square_of(end) == square_of(begin)) ++end;
      found.emplace_back(begin, end);
      begin = end;
    }
    return found;
  };
  const auto columns = parts(window.columns, [&](std::int64_t i) { return window.x(i); });
  std::vector<Range> squares;
  for (const auto& rows : parts(window.rows, [&](std::int64_t j) { return window.y(j); })) {
    for (const auto& some : columns) squares.push_back({some, rows});
  }
  return squares;
}

/// Makes facets only where nodes may be in a fillet.
void RoundedField::round_facets_of(const Range& range, SurfacePatch& patch) const {
  Eigen::AlignedBox2d doubtful;
  for (std::int64_t row = range.rows.first; row < range.rows.second; ++row) {
    for (std::int64_t i = range.columns.first; i < range.columns.second; ++i) {
      const std::size_t n = index_of(row * patch.window.columns + i);
      const Eigen::Vector2d q = patch.window.node(i, row);
      if (!surely_free(n, tangent_ball(q, plane_at(patch, n)), patch)) doubtful.extend(q);
    }
  }
  if (doubtful.isEmpty()) return;
  const Eigen::Vector2d around(radius_, radius_);
  const Executor serial = Executor::serial();
  const auto cutter = cut_->cutter({doubtful.min() - around, doubtful.max() + around}, serial);
  round(LowestBallSearch(*cutter, error_), range, serial, patch);
}

bool RoundedField::surely_free(std::size_t node, const Eigen::Vector3d& centre,
                               const SurfacePatch& patch) const {
  if (reach_) return reach_->surely_free(patch.cut[node], centre);
  return smooth_reach_ && smooth_reach_->surely_free(centre.head<2>());
}

Eigen::Vector3d RoundedField::tangent_ball(const Eigen::Vector2d& q,
                                           const TangentPlane& plane) const {
  const Eigen::Vector3d up(-plane.slope.x(), -plane.slope.y(), 1.0);
  return Eigen::Vector3d(q.x(), q.y(), plane.z) + radius_ * up.normalized();
}

void RoundedField::round(const LowestBallSearch& search, const Range& range,
                         const Executor& executor, SurfacePatch& patch) const {
  const std::int64_t columns = range.columns.second - range.columns.first;
  const std::int64_t rows = range.rows.second - range.rows.first;
  const std::int64_t runs = (columns + kRun - 1) / kRun;
  const auto round_run = [&](std::int64_t run) {
    const std::int64_t row = range.rows.first + run / runs;
    const std::int64_t begin = range.columns.first + run % runs * kRun;
    CutterLocation near;
    for (std::int64_t i = begin; i < std::min(range.columns.second, begin + kRun); ++i) {
      const std::size_t n = index_of(row * patch.window.columns + i);
      const Eigen::Vector2d q = patch.window.node(i, row);
      const TangentPlane plane = plane_at(patch, n);
      if (surely_free(n, tangent_ball(q, plane), patch)) continue;
      const LowestBall ball = search.over(q, plane, near);
      if (!(ball.z > plane.z)) continue;
      patch.z[n] = ball.z;
      const Eigen::Vector3d up = ball.centre - Eigen::Vector3d(q.x(), q.y(), ball.z);
      patch.slope_x[n] = -up.x() / up.z();
      patch.slope_y[n] = -up.y() / up.z();
      if (!patch.cut.empty()) patch.cut[n] = kFillet;
      patch.depth[n] = ball.z - plane.z;
      patch.width[n] = ball.spread;
    }
  };
  parallel_for(executor, "rounded surface", runs * rows, round_run, 1);
}

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
