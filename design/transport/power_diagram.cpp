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
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>

#include "core/error.h"

namespace lensforge {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase =
    CGAL::Triangulation_vertex_base_with_info_2<int, Kernel,
                                                CGAL::Regular_triangulation_vertex_base_2<Kernel>>;
using FaceBase =
    CGAL::Triangulation_face_base_with_info_2<int, Kernel,
                                              CGAL::Regular_triangulation_face_base_2<Kernel>>;
using Structure = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Regular = CGAL::Regular_triangulation_2<Kernel, Structure>;

/// Insertions between two checks of the stop token; about 10 ms.
constexpr std::size_t kStopInterval = 4096;

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

/// The triangulation as plain numbers: vertex −1 is the one at infinity.
struct FlatFaces {
  std::vector<std::array<int, 3>> vertices;
  std::vector<std::array<int, 3>> neighbours;

  [[nodiscard]] bool infinite(std::size_t f) const {
    const auto& v = vertices[f];
    return v[0] < 0 || v[1] < 0 || v[2] < 0;
  }
};

FlatFaces flatten(Regular& regular) {
  const auto& structure = regular.tds();
  int count = 0;
  for (auto f = structure.faces_begin(); f != structure.faces_end(); ++f) f->info() = count++;
  FlatFaces flat;
  flat.vertices.reserve(static_cast<std::size_t>(count));
  flat.neighbours.reserve(static_cast<std::size_t>(count));
  for (auto f = structure.faces_begin(); f != structure.faces_end(); ++f) {
    const auto number = [&](int k) {
      return regular.is_infinite(f->vertex(k)) ? -1 : f->vertex(k)->info();
    };
    flat.vertices.push_back({number(0), number(1), number(2)});
    flat.neighbours.push_back(
        {f->neighbor(0)->info(), f->neighbor(1)->info(), f->neighbor(2)->info()});
  }
  return flat;
}

}  // namespace

struct PowerDiagram::Triangulation {
  Regular regular;
};

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
    : triangulation_(std::make_unique<Triangulation>()), sites_(sites), weights_(weights) {
  LF_CHECK(sites.cols() >= 1 && weights.size() == sites.cols(), std::to_string(sites.cols()));
  LF_CHECK(sites.allFinite() && weights.allFinite(), "sites and weights");
  Regular& regular = triangulation_->regular;
  Regular::Face_handle hint;
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (k % kStopInterval == 0 && stop.stop_requested()) throw Interrupted();
    const int i = order[k];
    const Regular::Weighted_point point({sites(0, i), sites(1, i)}, weights[i]);
    const Regular::Vertex_handle vertex = regular.insert(point, hint);
    vertex->info() = i;
    hint = vertex->face();
  }
  for (auto v = regular.hidden_vertices_begin(); v != regular.hidden_vertices_end(); ++v) {
    hidden_.push_back(v->info());
  }
  std::sort(hidden_.begin(), hidden_.end());
}

int PowerDiagram::owner(const Eigen::Vector2d& point) const {
  Eigen::Index site = 0;
  ((sites_.colwise() - point).colwise().squaredNorm().transpose() - weights_).minCoeff(&site);
  return static_cast<int>(site);
}

bool PowerDiagram::is_planar() const { return triangulation_->regular.dimension() == 2; }

std::vector<std::pair<int, int>> PowerDiagram::neighbours() const {
  const Regular& regular = triangulation_->regular;
  std::vector<std::pair<int, int>> pairs;
  for (auto e = regular.finite_edges_begin(); e != regular.finite_edges_end(); ++e) {
    pairs.emplace_back(e->first->vertex(Regular::ccw(e->second))->info(),
                       e->first->vertex(Regular::cw(e->second))->info());
  }
  return pairs;
}

PowerDiagram::~PowerDiagram() = default;
PowerDiagram::PowerDiagram(PowerDiagram&&) noexcept = default;
PowerDiagram& PowerDiagram::operator=(PowerDiagram&&) noexcept = default;

namespace {

/// Where the power distances to a face's three sites agree; not finite if they lie on one line.
Eigen::Vector2d radical_centre(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights,
                               const std::array<int, 3>& v) {
  const Eigen::Vector2d origin = sites.col(v[0]);
  const Eigen::Vector2d b = sites.col(v[1]) - origin;
  const Eigen::Vector2d c = sites.col(v[2]) - origin;
  const double double_area = b.x() * c.y() - b.y() * c.x();
  const double rb = 0.5 * (b.squaredNorm() - (weights[v[1]] - weights[v[0]])) / double_area;
  const double rc = 0.5 * (c.squaredNorm() - (weights[v[2]] - weights[v[0]])) / double_area;
  return origin + Eigen::Vector2d(rb * c.y() - rc * b.y(), rc * b.x() - rb * c.x());
}

/// Edges of a triangulation whose sites lie on one line: whole radical axes.
std::vector<DualEdge> parallel_edges(const Regular& regular, const Eigen::Matrix2Xd& sites,
                                     const Eigen::VectorXd& weights, double reach) {
  std::vector<DualEdge> edges;
  for (auto e = regular.finite_edges_begin(); e != regular.finite_edges_end(); ++e) {
    const int a = e->first->vertex(Regular::ccw(e->second))->info();
    const int b = e->first->vertex(Regular::cw(e->second))->info();
    const RadicalAxis axis(sites.col(a), sites.col(b), weights[a] - weights[b], sites.col(0));
    edges.push_back({a, b, axis.base - reach * axis.direction, axis.base + reach * axis.direction});
  }
  return edges;
}

}  // namespace

std::vector<DualEdge> PowerDiagram::dual_edges(double reach, const Executor& executor) const {
  Regular& regular = triangulation_->regular;
  if (regular.dimension() < 1) return {};
  if (regular.dimension() == 1) return parallel_edges(regular, sites_, weights_, reach);
  const FlatFaces flat = flatten(regular);
  const auto count = static_cast<std::int64_t>(flat.vertices.size());
  Eigen::Matrix2Xd centres(2, count);
  parallel_for(executor, "power vertices", count, [&](std::int64_t f) {
    const auto face = static_cast<std::size_t>(f);
    if (!flat.infinite(face))
      centres.col(f) = radical_centre(sites_, weights_, flat.vertices[face]);
  });
  std::vector<std::pair<int, int>> sides;  // face and the number of the vertex opposite to the edge
  sides.reserve(flat.vertices.size() * 3 / 2);
  for (std::size_t f = 0; f < flat.vertices.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const bool first = static_cast<int>(f) < flat.neighbours[f][k];
      const bool finite = flat.vertices[f][(k + 1) % 3] >= 0 && flat.vertices[f][(k + 2) % 3] >= 0;
      if (first && finite) sides.emplace_back(static_cast<int>(f), static_cast<int>(k));
    }
  }
  std::vector<DualEdge> edges(sides.size());
  parallel_for(
      executor, "power edges", static_cast<std::int64_t>(sides.size()), [&](std::int64_t e) {
        const auto [face, k] = sides[static_cast<std::size_t>(e)];
        const auto f = static_cast<std::size_t>(face);
        const auto corner = static_cast<std::size_t>(k);
        const int a = flat.vertices[f][(corner + 1) % 3];
        const int b = flat.vertices[f][(corner + 2) % 3];
        const auto g = static_cast<std::size_t>(flat.neighbours[f][corner]);
        const RadicalAxis axis(sites_.col(a), sites_.col(b), weights_[a] - weights_[b],
                               sites_.col(0));
        const auto end = [&](std::size_t side, bool forward) -> Eigen::Vector2d {
          if (flat.infinite(side)) {
            return axis.base + (forward ? reach : -reach) * axis.direction;
          }
          return axis.bounded(centres.col(static_cast<Eigen::Index>(side)), reach, forward);
        };
        edges[static_cast<std::size_t>(e)] = {a, b, end(g, false), end(f, true)};
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

PowerDiagram::Place place_in_face(const Eigen::Matrix2Xd& sites, const Regular::Face_handle& face,
                                  const Eigen::Vector2d& point) {
  PowerDiagram::Place place;
  std::array<Eigen::Vector2d, 3> to;
  for (std::size_t k = 0; k < 3; ++k) {
    place.sites[k] = face->vertex(static_cast<int>(k))->info();
    to[k] = sites.col(place.sites[k]) - point;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector2d& a = to[(k + 1) % 3];
    const Eigen::Vector2d& b = to[(k + 2) % 3];
    place.share[static_cast<Eigen::Index>(k)] = std::max(0.0, a.x() * b.y() - a.y() * b.x());
  }
  const double sum = place.share.sum();
  place.share = sum > 0.0 ? Eigen::Vector3d(place.share / sum) : Eigen::Vector3d(1.0, 0.0, 0.0);
  return place;
}

}  // namespace

std::vector<PowerDiagram::Place> PowerDiagram::locate(const Eigen::Matrix2Xd& points,
                                                      const std::vector<int>& order) const {
  const Regular& regular = triangulation_->regular;
  LF_CHECK(regular.dimension() == 2, std::to_string(regular.dimension()));
  const auto infinite = regular.infinite_vertex();
  std::vector<Place> places(order.size());
  Regular::Face_handle hint = regular.finite_faces_begin();
  for (const int i : order) {
    const Eigen::Vector2d point = points.col(i);
    Regular::Face_handle face =
        regular.locate(Regular::Weighted_point({point.x(), point.y()}, 0.0), hint);
    Place& place = places[static_cast<std::size_t>(i)];
    if (!regular.is_infinite(face)) {
      place = place_in_face(sites_, face, point);
      hint = face;
      continue;
    }
    const auto on_hull = [&](const Regular::Face_handle& f) {
      const int k = f->index(infinite);
      return place_on_segment(sites_, f->vertex(Regular::ccw(k))->info(),
                              f->vertex(Regular::cw(k))->info(), point);
    };
    const auto distance = [&](const Place& p) {
      return (p.share[0] * sites_.col(p.sites[0]) + p.share[1] * sites_.col(p.sites[1]) - point)
          .squaredNorm();
    };
    place = on_hull(face);
    for (const bool forward : {true, false}) {
      Regular::Face_handle walker = face;
      for (;;) {
        const int k = walker->index(infinite);
        walker = walker->neighbor(forward ? Regular::ccw(k) : Regular::cw(k));
        const Place next = on_hull(walker);
        if (!(distance(next) < distance(place))) break;
        place = next;
      }
    }
    hint = face->neighbor(face->index(infinite));
  }
  return places;
}

}  // namespace lensforge
