// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/power_diagram.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_2.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>

#include "core/error.h"

namespace lensforge {

namespace {

Eigen::Vector2d left_of(const Eigen::Vector2d& v) { return {-v.y(), v.x()}; }

/// The radical axis of two sites: a point of it and its direction, to the left of a → b.
struct RadicalAxis {
  Eigen::Vector2d base;
  Eigen::Vector2d direction;

  /// `near` is the point to whose foot on the axis `base` is moved.
  RadicalAxis(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double weight_difference,
              const Eigen::Vector2d& near) {
    const Eigen::Vector2d d = b - a;
    const double squared = d.squaredNorm();
    const Eigen::Vector2d normal = d / std::sqrt(squared);
    const double share = 0.5 + 0.5 * weight_difference / squared;
    base = near + normal * (a + share * d - near).dot(normal);
    direction = left_of(normal);
  }

  /// `end` itself, or, where it is farther than `reach` from the base or not finite, the point of
  /// the axis at that distance, forward if `forward` cannot be read off `end`.
  [[nodiscard]] Eigen::Vector2d bounded(const Eigen::Vector2d& end, double reach,
                                        bool forward) const {
    if ((end - base).squaredNorm() <= reach * reach) return end;
    const double t = (end - base).dot(direction);
    if (!std::isfinite(t)) return base + (forward ? reach : -reach) * direction;
    return base + std::clamp(t, -reach, reach) * direction;
  }
};

}  // namespace

std::vector<int> spatial_order(const Eigen::Matrix2Xd& sites) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Point = Kernel::Point_2;
  std::vector<Point> points;
  points.reserve(static_cast<std::size_t>(sites.cols()));
  for (Eigen::Index i = 0; i < sites.cols(); ++i) points.emplace_back(sites(0, i), sites(1, i));
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  using Map = CGAL::Pointer_property_map<Point>::const_type;
  const CGAL::Spatial_sort_traits_adapter_2<Kernel, Map> traits(
      CGAL::make_property_map(static_cast<const std::vector<Point>&>(points)));
  CGAL::spatial_sort(order.begin(), order.end(), traits);
  return {order.begin(), order.end()};
}

PowerDiagram::PowerDiagram(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights,
                           const std::vector<int>& order, const std::stop_token& stop)
    : PowerDiagram(std::make_shared<const Eigen::Matrix2Xd>(sites), weights, order, stop) {}

PowerDiagram::PowerDiagram(std::shared_ptr<const Eigen::Matrix2Xd> sites, Eigen::VectorXd weights,
                           const std::vector<int>& order, const std::stop_token& stop)
    : sites_(std::move(sites)),
      weights_(std::move(weights)),
      triangulation_(*sites_, weights_, order, stop) {}

std::optional<PowerDiagram> PowerDiagram::reweighted(const Eigen::VectorXd& weights,
                                                     const std::vector<int>& order,
                                                     const Executor& executor,
                                                     int max_raises) const {
  if (!is_planar() || !hidden().empty()) {
    PowerDiagram rebuilt(sites_, weights, order, executor.stop_token());
    if (!rebuilt.hidden().empty()) return std::nullopt;
    return rebuilt;
  }
  PowerDiagram flipped = *this;
  flipped.weights_ = weights;
  if (!flipped.triangulation_.reweight(*sites_, weights_, flipped.weights_, max_raises, executor)) {
    return std::nullopt;
  }
  return flipped;
}

int PowerDiagram::owner(const Eigen::Vector2d& point) const {
  Eigen::Index site = 0;
  ((sites_->colwise() - point).colwise().squaredNorm().transpose() - weights_).minCoeff(&site);
  return static_cast<int>(site);
}

std::vector<PowerDiagram::Side> PowerDiagram::sorted_sides() const {
  const std::vector<TriangleFace>& faces = triangulation_.faces();
  // Of the two faces at a side, one sees the lower number first.
  const auto each_side = [&](const auto& visit) {
    for (std::size_t f = 0; f < faces.size(); ++f) {
      for (std::size_t k = 0; k < 3; ++k) {
        const int first = faces[f].first(k);
        const int second = faces[f].second(k);
        if (first >= 0 && first < second) {
          visit(static_cast<std::size_t>(first),
                Side{second, static_cast<int>(f), static_cast<int>(k)});
        }
      }
    }
  };
  std::vector<std::size_t> begin(static_cast<std::size_t>(sites_->cols()) + 1, 0);
  each_side([&](std::size_t first, const Side&) { ++begin[first + 1]; });
  for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
  std::vector<Side> sides(begin.back());
  // Afterwards begin[i] is where those of i end.
  each_side([&](std::size_t first, const Side& side) { sides[begin[first]++] = side; });
  std::size_t from = 0;
  for (const std::size_t to : begin) {
    std::sort(sides.begin() + static_cast<std::ptrdiff_t>(from),
              sides.begin() + static_cast<std::ptrdiff_t>(to),
              [](const Side& a, const Side& b) { return a.second < b.second; });
    from = to;
  }
  return sides;
}

std::vector<std::pair<int, int>> PowerDiagram::neighbours() const {
  if (!is_planar()) return triangulation_.line();
  std::vector<std::pair<int, int>> pairs;
  for (const Side& side : sorted_sides()) {
    const TriangleFace& face = triangulation_.faces()[static_cast<std::size_t>(side.face)];
    pairs.emplace_back(face.first(static_cast<std::size_t>(side.corner)), side.second);
  }
  return pairs;
}

/// Of sites on one line: whole radical axes.
std::vector<DualEdge> PowerDiagram::parallel_edges(double reach) const {
  std::vector<DualEdge> edges;
  for (const auto& [a, b] : triangulation_.line()) {
    const RadicalAxis axis(sites_->col(a), sites_->col(b), weights_[a] - weights_[b],
                           sites_->col(0));
    edges.push_back({a, b, axis.base - reach * axis.direction, axis.base + reach * axis.direction});
  }
  return edges;
}

namespace {

/// Where the power distances to a face's three sites agree. Seen from the lowest site, so that the
/// bits do not depend on which corner comes first.
Eigen::Vector2d radical_centre(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights,
                               std::array<int, 3> v) {
  std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
  const Eigen::Vector2d origin = sites.col(v[0]);
  const Eigen::Vector2d b = sites.col(v[1]) - origin;
  const Eigen::Vector2d c = sites.col(v[2]) - origin;
  // Faces run counterclockwise, by exact arithmetic. On the hull there are some so thin that
  // rounding can leave any sign: their centres lie far out, not far in.
  const double least = std::numeric_limits<double>::epsilon() * b.norm() * c.norm();
  const double double_area = std::max(least, b.x() * c.y() - b.y() * c.x());
  const double rb = 0.5 * (b.squaredNorm() - (weights[v[1]] - weights[v[0]])) / double_area;
  const double rc = 0.5 * (c.squaredNorm() - (weights[v[2]] - weights[v[0]])) / double_area;
  return origin + Eigen::Vector2d(rb * c.y() - rc * b.y(), rc * b.x() - rb * c.x());
}

}  // namespace

std::vector<DualEdge> PowerDiagram::dual_edges(double reach, const Executor& executor) const {
  if (!is_planar()) return parallel_edges(reach);
  const std::vector<TriangleFace>& faces = triangulation_.faces();
  const auto count = static_cast<std::int64_t>(faces.size());
  Eigen::Matrix2Xd centres(2, count);
  parallel_for(executor, "power vertices", count, [&](std::int64_t f) {
    const TriangleFace& face = faces[static_cast<std::size_t>(f)];
    if (face.is_finite()) centres.col(f) = radical_centre(*sites_, weights_, face.vertex);
  });
  const std::vector<Side> sides = sorted_sides();
  std::vector<DualEdge> edges(sides.size());
  parallel_for(executor, "power edges", static_cast<std::int64_t>(sides.size()),
               [&](std::int64_t e) {
                 const Side& side = sides[static_cast<std::size_t>(e)];
                 const TriangleFace& face = faces[static_cast<std::size_t>(side.face)];
                 const auto k = static_cast<std::size_t>(side.corner);
                 const int a = face.first(k);
                 const int b = side.second;
                 const RadicalAxis axis(sites_->col(a), sites_->col(b), weights_[a] - weights_[b],
                                        sites_->col(0));
                 const auto end = [&](int f, bool forward) -> Eigen::Vector2d {
                   if (faces[static_cast<std::size_t>(f)].is_finite()) {
                     return axis.bounded(centres.col(f), reach, forward);
                   }
                   return axis.base + (forward ? reach : -reach) * axis.direction;
                 };
                 edges[static_cast<std::size_t>(e)] = {a, b, end(face.neighbour[k], false),
                                                       end(side.face, true)};
               });
  return edges;
}

namespace {

/// Nearest place on the segment between two sites.
PowerDiagram::Place place_on_segment(const Eigen::Matrix2Xd& sites, int a, int b,
                                     const Eigen::Vector2d& point) {
  const Eigen::Vector2d d = sites.col(b) - sites.col(a);
  const double share = std::clamp((point - sites.col(a)).dot(d) / d.squaredNorm(), 0.0, 1.0);
  return {{a, b, a}, {1.0 - share, share, 0.0}};
}

PowerDiagram::Place place_in_face(const Eigen::Matrix2Xd& sites, const TriangleFace& face,
                                  const Eigen::Vector2d& point) {
  PowerDiagram::Place place;
  place.sites = face.vertex;
  std::array<Eigen::Vector2d, 3> to;
  for (std::size_t k = 0; k < 3; ++k) to[k] = sites.col(place.sites[k]) - point;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector2d& a = to[(k + 1) % 3];
    const Eigen::Vector2d& b = to[(k + 2) % 3];
    place.share[static_cast<Eigen::Index>(k)] = std::max(0.0, a.x() * b.y() - a.y() * b.x());
  }
  const double sum = place.share.sum();
  place.share = sum > 0.0 ? Eigen::Vector3d(place.share / sum) : Eigen::Vector3d(1.0, 0.0, 0.0);
  return place;
}

/// Walks through the faces of a triangulation.
class FaceWalk {
 public:
  FaceWalk(const Eigen::Matrix2Xd& sites, const std::vector<TriangleFace>& faces)
      : sites_(sites), faces_(faces) {
    while (!face(at_).is_finite()) ++at_;
  }

  /// @return the face that holds the point, or one beyond a side of the hull that it lies behind.
  /// Towards a point regular triangulations have no circle of faces, so it comes to an end.
  int find(const Eigen::Vector2d& point) {
    int next = at_;
    while (next >= 0) {
      at_ = next;
      if (!face(at_).is_finite()) {
        const int outside = at_;
        at_ = face(outside).neighbour[corner_at_infinity(outside)];
        return outside;
      }
      next = towards(point);
    }
    return at_;
  }

  /// Nearest place on the hull, from a face beyond it.
  [[nodiscard]] PowerDiagram::Place on_hull(int outside, const Eigen::Vector2d& point) const {
    PowerDiagram::Place best = on_side(outside, point);
    for (const std::size_t turn : {1U, 2U}) {
      int walker = outside;
      for (;;) {
        walker = face(walker).neighbour[(corner_at_infinity(walker) + turn) % 3];
        const PowerDiagram::Place next = on_side(walker, point);
        if (!(distance(next, point) < distance(best, point))) break;
        best = next;
      }
    }
    return best;
  }

  [[nodiscard]] const TriangleFace& face(int f) const {
    return faces_[static_cast<std::size_t>(f)];
  }

 private:
  /// The face behind a side of this one that the point lies behind; −1 if there is none.
  [[nodiscard]] int towards(const Eigen::Vector2d& point) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (side_of_line(sites_.col(face(at_).first(k)), sites_.col(face(at_).second(k)), point) < 0)
        return face(at_).neighbour[k];
    }
    return -1;
  }
  [[nodiscard]] std::size_t corner_at_infinity(int f) const {
    const std::array<int, 3>& v = face(f).vertex;
    return static_cast<std::size_t>(std::min_element(v.begin(), v.end()) - v.begin());
  }
  [[nodiscard]] PowerDiagram::Place on_side(int outside, const Eigen::Vector2d& point) const {
    const std::size_t k = corner_at_infinity(outside);
    return place_on_segment(sites_, face(outside).first(k), face(outside).second(k), point);
  }
  [[nodiscard]] double distance(const PowerDiagram::Place& p, const Eigen::Vector2d& point) const {
    return (p.share[0] * sites_.col(p.sites[0]) + p.share[1] * sites_.col(p.sites[1]) - point)
        .squaredNorm();
  }

  const Eigen::Matrix2Xd& sites_;
  const std::vector<TriangleFace>& faces_;
  int at_ = 0;
};

}  // namespace

std::vector<PowerDiagram::Place> PowerDiagram::locate(const Eigen::Matrix2Xd& points,
                                                      const std::vector<int>& order) const {
  LF_CHECK(is_planar(), std::to_string(sites_->cols()));
  FaceWalk walk(*sites_, triangulation_.faces());
  std::vector<Place> places(order.size());
  for (const int i : order) {
    const Eigen::Vector2d point = points.col(i);
    const int f = walk.find(point);
    places[static_cast<std::size_t>(i)] = walk.face(f).is_finite()
                                              ? place_in_face(*sites_, walk.face(f), point)
                                              : walk.on_hull(f, point);
  }
  return places;
}

}  // namespace lensforge
