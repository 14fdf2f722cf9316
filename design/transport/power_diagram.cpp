// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/power_diagram.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Regular_triangulation_2.h>
#include <CGAL/Regular_triangulation_face_base_2.h>
#include <CGAL/Regular_triangulation_vertex_base_2.h>
#include <CGAL/Spatial_sort_traits_adapter_2.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

}  // namespace

int side_of_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p) {
  const double left = (b.x() - a.x()) * (p.y() - a.y());
  const double right = (b.y() - a.y()) * (p.x() - a.x());
  // Shewchuk 1997, orient2d: (3 + 16ε) ε; the tiny number covers underflow.
  const double error = 4.0 * 0x1p-53 * (std::fabs(left) + std::fabs(right)) + 1e-290;
  if (std::fabs(left - right) > error) return left > right ? 1 : -1;
  using Point = Kernel::Point_2;
  return static_cast<int>(
      CGAL::orientation(Point(a.x(), a.y()), Point(b.x(), b.y()), Point(p.x(), p.y())));
}

bool PowerTest::is_below_exactly(int a, int b, int c, int p) const {
  const auto point = [&](int i) {
    return Kernel::Weighted_point_2({sites_(0, i), sites_(1, i)}, weights_[i]);
  };
  const CGAL::Oriented_side side = Kernel().power_side_of_oriented_power_circle_2_object()(
      point(a), point(b), point(c), point(p));
  if (side != CGAL::ON_ORIENTED_BOUNDARY) return side == CGAL::ON_POSITIVE_SIDE;
  // The perturbation of the last site in lexicographic order counts most; one of two decides.
  std::array<int, 4> order{a, b, c, p};
  std::sort(order.begin(), order.end(), [&](int i, int j) {
    return std::tuple(sites_(0, i), sites_(1, i)) < std::tuple(sites_(0, j), sites_(1, j));
  });
  for (const int last : {order[3], order[2]}) {
    if (last == p) return false;
    const auto with_p = [&](int i) { return sites_.col(i == last ? p : i); };
    const int turn = side_of_line(with_p(a), with_p(b), with_p(c));
    if (turn != 0) return turn > 0;
  }
  return false;
}

namespace {

using VertexBase =
    CGAL::Triangulation_vertex_base_with_info_2<int, Kernel,
                                                CGAL::Regular_triangulation_vertex_base_2<Kernel>>;
using FaceBase =
    CGAL::Triangulation_face_base_with_info_2<int, Kernel,
                                              CGAL::Regular_triangulation_face_base_2<Kernel>>;
using Structure = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Regular = CGAL::Regular_triangulation_2<Kernel, Structure>;

/// Insertions or flips between two checks of the stop token; about 10 ms.
constexpr std::size_t kStopInterval = 4096;

Regular inserted(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights,
                 const std::vector<int>& order, const std::stop_token& stop) {
  Regular regular;
  Regular::Face_handle hint;
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (k % kStopInterval == 0 && stop.stop_requested()) throw Interrupted();
    const int i = order[k];
    const Regular::Weighted_point point({sites(0, i), sites(1, i)}, weights[i]);
    const Regular::Vertex_handle vertex = regular.insert(point, hint);
    vertex->info() = i;
    hint = vertex->face();
  }
  return regular;
}

/// Numbers the faces by their lowest site, so that faces of neighbouring sites are close in memory.
void number_faces(Regular& regular, std::size_t sites) {
  const auto lowest = [&](const Regular::Face_handle& f) {
    int low = static_cast<int>(sites);
    for (int k = 0; k < 3; ++k) {
      if (!regular.is_infinite(f->vertex(k))) low = std::min(low, f->vertex(k)->info());
    }
    return static_cast<std::size_t>(low);
  };
  std::vector<int> next(sites + 1, 0);
  for (const auto f : regular.all_face_handles()) ++next[lowest(f) + 1];
  for (std::size_t i = 0; i < sites; ++i) next[i + 1] += next[i];
  for (const auto f : regular.all_face_handles()) f->info() = next[lowest(f)]++;
}

std::vector<TriangleFace> compact_faces(Regular& regular, std::size_t sites) {
  number_faces(regular, sites);
  std::vector<TriangleFace> faces(regular.all_face_handles().size());
  for (const auto f : regular.all_face_handles()) {
    TriangleFace& face = faces[static_cast<std::size_t>(f->info())];
    for (int k = 0; k < 3; ++k) {
      const auto v = f->vertex(k);
      face.vertex[static_cast<std::size_t>(k)] =
          regular.is_infinite(v) ? TriangleFace::kAtInfinity : v->info();
      face.neighbour[static_cast<std::size_t>(k)] = f->neighbor(k)->info();
    }
  }
  return faces;
}

}  // namespace

RegularTriangulation::RegularTriangulation(const Eigen::Matrix2Xd& sites,
                                           const Eigen::VectorXd& weights,
                                           const std::vector<int>& order,
                                           const std::stop_token& stop) {
  Regular regular = inserted(sites, weights, order, stop);
  for (auto v = regular.hidden_vertices_begin(); v != regular.hidden_vertices_end(); ++v) {
    hidden_.push_back(v->info());
  }
  std::sort(hidden_.begin(), hidden_.end());
  if (regular.dimension() == 2) {
    faces_ = compact_faces(regular, static_cast<std::size_t>(sites.cols()));
  } else if (regular.dimension() == 1) {
    for (auto e = regular.finite_edges_begin(); e != regular.finite_edges_end(); ++e) {
      line_.emplace_back(e->first->vertex(Regular::ccw(e->second))->info(),
                         e->first->vertex(Regular::cw(e->second))->info());
    }
  }
}

std::size_t RegularTriangulation::corner_towards(std::size_t f, int neighbour) const {
  const std::array<int, 3>& n = faces_[f].neighbour;
  return n[0] == neighbour ? 0 : (n[1] == neighbour ? 1 : 2);
}

/// Sides of the hull stay: the sites at its corners do not depend on weights, and a site on one of
/// its sides is hidden only if a side inside proves it.
bool RegularTriangulation::is_proper(const PowerTest& test, std::size_t f, std::size_t k) const {
  const TriangleFace& face = faces_[f];
  const auto g = static_cast<std::size_t>(face.neighbour[k]);
  if (!face.is_finite() || !faces_[g].is_finite()) return true;
  const int opposite = faces_[g].vertex[corner_towards(g, static_cast<int>(f))];
  return !test.is_below(face.vertex[0], face.vertex[1], face.vertex[2], opposite);
}

std::vector<RegularTriangulation::Side> RegularTriangulation::improper_sides(
    const PowerTest& test, const Executor& executor) const {
  std::vector<std::uint8_t> bits(faces_.size());
  parallel_for(executor, "regular sides", static_cast<std::int64_t>(faces_.size()),
               [&](std::int64_t i) {
                 const auto f = static_cast<std::size_t>(i);
                 unsigned improper = 0;
                 for (std::size_t k = 0; k < 3; ++k) {
                   const bool mine = faces_[f].neighbour[k] > i;
                   if (mine && !is_proper(test, f, k)) improper |= 1U << k;
                 }
                 bits[f] = static_cast<std::uint8_t>(improper);
               });
  std::vector<Side> sides;
  for (std::size_t f = 0; f < bits.size(); ++f) {
    for (std::int32_t k = 0; k < 3; ++k) {
      if ((bits[f] >> k & 1U) != 0U) sides.push_back({static_cast<std::int32_t>(f), k});
    }
  }
  return sides;
}

bool RegularTriangulation::can_flip(const PowerTest& test, std::size_t f, std::size_t k) const {
  const TriangleFace& face = faces_[f];
  const auto g = static_cast<std::size_t>(face.neighbour[k]);
  const int opposite = faces_[g].vertex[corner_towards(g, static_cast<int>(f))];
  return test.is_counterclockwise(face.vertex[k], face.first(k), opposite) &&
         test.is_counterclockwise(opposite, face.second(k), face.vertex[k]);
}

/// Turns triangles p a b and q b a into p a q and q b p in their places; corners 0 and 2 of both
/// then lie opposite to the four outer sides.
void RegularTriangulation::flip(std::size_t f, std::size_t k) {
  TriangleFace& left = faces_[f];
  const int g = left.neighbour[k];
  TriangleFace& right = faces_[static_cast<std::size_t>(g)];
  const auto this_face = static_cast<int>(f);
  const std::size_t j = corner_towards(static_cast<std::size_t>(g), this_face);
  const int p = left.vertex[k];
  const int q = right.vertex[j];
  const int a = left.first(k);
  const int b = left.second(k);
  const int beyond_bp = left.neighbour[(k + 1) % 3];
  const int beyond_pa = left.neighbour[(k + 2) % 3];
  const int beyond_aq = right.neighbour[(j + 1) % 3];
  const int beyond_qb = right.neighbour[(j + 2) % 3];
  left = {{p, a, q}, {beyond_aq, g, beyond_pa}};
  right = {{q, b, p}, {beyond_bp, this_face, beyond_qb}};
  const auto bp = static_cast<std::size_t>(beyond_bp);
  const auto aq = static_cast<std::size_t>(beyond_aq);
  faces_[bp].neighbour[corner_towards(bp, this_face)] = g;
  faces_[aq].neighbour[corner_towards(aq, g)] = this_face;
}

RegularTriangulation::HiddenSite RegularTriangulation::hidden_by(const PowerTest& test,
                                                                 std::size_t f,
                                                                 std::size_t k) const {
  const TriangleFace& face = faces_[f];
  const auto g = static_cast<std::size_t>(face.neighbour[k]);
  const int opposite = faces_[g].vertex[corner_towards(g, static_cast<int>(f))];
  const int a = face.first(k);
  const int b = face.second(k);
  if (!test.is_counterclockwise(face.vertex[k], a, opposite)) {
    return {a, {face.vertex[k], opposite, b}};
  }
  return {b, {opposite, face.vertex[k], a}};
}

void RegularTriangulation::append_star(std::size_t f, int site, std::vector<Side>& sides) const {
  std::size_t at = f;
  do {
    for (std::int32_t k = 0; k < 3; ++k) sides.push_back({static_cast<std::int32_t>(at), k});
    const std::array<int, 3>& v = faces_[at].vertex;
    const std::size_t corner = v[0] == site ? 0 : (v[1] == site ? 1 : 2);
    at = static_cast<std::size_t>(faces_[at].neighbour[(corner + 1) % 3]);
  } while (at != f);
}

namespace {

/// A raised site lies below the triangle around it by this share of its previous depth, or by the
/// second share of its depth without weights if that is more. Both are far above rounding, so sites
/// that hide each other in turn come to an end.
constexpr double kDepthKept = 0.5;
constexpr double kMinDepth = 1e-6;

/// Depth of a site's height below the plane through those of the triangle around it.
class Depth {
 public:
  Depth(const Eigen::Matrix2Xd& sites, int site, const std::array<int, 3>& around)
      : site_(site), around_(around) {
    std::array<Eigen::Vector2d, 3> to;
    for (std::size_t k = 0; k < 3; ++k) to[k] = sites.col(around[k]) - sites.col(site);
    for (std::size_t k = 0; k < 3; ++k) share_[k] = cross(to[(k + 1) % 3], to[(k + 2) % 3]);
    const double area = share_[0] + share_[1] + share_[2];
    for (std::size_t k = 0; k < 3; ++k) {
      share_[k] /= area;
      without_weights_ += share_[k] * to[k].squaredNorm();
    }
  }
  [[nodiscard]] double without_weights() const { return without_weights_; }
  [[nodiscard]] double under(const Eigen::VectorXd& weights) const {
    double depth = without_weights_;
    for (std::size_t k = 0; k < 3; ++k) depth -= share_[k] * (weights[around_[k]] - weights[site_]);
    return depth;
  }

 private:
  int site_;
  std::array<int, 3> around_;
  std::array<double, 3> share_{};  ///< The site's barycentric coordinates.
  double without_weights_ = 0.0;
};

}  // namespace

bool RegularTriangulation::reweight(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& before,
                                    Eigen::VectorXd& weights, int max_raises,
                                    const Executor& executor) {
  LF_CHECK(is_planar() && hidden_.empty(), std::to_string(hidden_.size()));
  const PowerTest test(sites, weights);
  // A flip lowers the lifted surface, so this terminates. A side that another flip has moved is
  // checked again among that flip's outer sides.
  std::vector<Side> todo = improper_sides(test, executor);
  std::reverse(todo.begin(), todo.end());
  int raises = 0;
  for (std::size_t steps = 1; !todo.empty(); ++steps) {
    if (steps % kStopInterval == 0 && executor.stop_token().stop_requested()) throw Interrupted();
    const auto f = static_cast<std::size_t>(todo.back().face);
    const auto k = static_cast<std::size_t>(todo.back().corner);
    todo.pop_back();
    if (is_proper(test, f, k)) continue;
    if (!can_flip(test, f, k)) {
      if (++raises > max_raises) return false;
      const auto [site, around] = hidden_by(test, f, k);
      const Depth depth(sites, site, around);
      const double wanted =
          std::max(kDepthKept * depth.under(before), kMinDepth * depth.without_weights());
      const double raise = wanted - depth.under(weights);
      if (!std::isfinite(raise)) return false;  // The triangle is too thin.
      weights[site] += raise;
      append_star(f, site, todo);
      continue;
    }
    const int g = faces_[f].neighbour[k];
    flip(f, k);
    for (const int changed : {static_cast<int>(f), g}) {
      todo.push_back({changed, 0});
      todo.push_back({changed, 2});
    }
  }
  return true;
}

namespace {

Eigen::Vector2d left_of(const Eigen::Vector2d& v) { return {-v.y(), v.x()}; }

/// The radical axis of two sites: a point of it and its direction, to the left of a → b.
struct RadicalAxis {
  Eigen::Vector2d base;
  Eigen::Vector2d direction;

  /// @param near  `base` is its foot on the axis.
  RadicalAxis(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double weight_difference,
              const Eigen::Vector2d& near) {
    const Eigen::Vector2d d = b - a;
    const double squared = d.squaredNorm();
    const Eigen::Vector2d normal = d / std::sqrt(squared);
    const double share = 0.5 + 0.5 * weight_difference / squared;
    base = near + normal * (a + share * d - near).dot(normal);
    direction = left_of(normal);
  }

  /// Returns `end`; if it is farther than `reach` from the base or not finite, the point of the
  /// axis at that distance. `forward` decides the direction if `end` does not.
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
  // One of the two faces at a side has the lower number first.
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
  // Afterwards begin[i] is the end of i's sides.
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

/// Edges of sites on one line: whole radical axes.
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

/// Point of equal power distance to a face's three sites, computed from the lowest site so that the
/// bits do not depend on the first corner.
Eigen::Vector2d radical_centre(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights,
                               std::array<int, 3> v) {
  std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
  const Eigen::Vector2d origin = sites.col(v[0]);
  const Eigen::Vector2d b = sites.col(v[1]) - origin;
  const Eigen::Vector2d c = sites.col(v[2]) - origin;
  // Faces run counterclockwise, by exact arithmetic. Some on the hull are so thin that rounding can
  // give any sign; their centres lie far outside.
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

/// Nearest point of the segment between two sites.
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

  /// Returns the face that holds the point, or a face beyond a side of the hull that separates it.
  /// Faces of regular triangulations are acyclic towards a point, so the walk ends.
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

  /// Nearest point of the hull, starting from a face beyond it.
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
  /// The face across a side that separates this face from the point; −1 if there is none.
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
