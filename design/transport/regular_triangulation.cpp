// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/regular_triangulation.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Regular_triangulation_2.h>
#include <CGAL/Regular_triangulation_face_base_2.h>
#include <CGAL/Regular_triangulation_vertex_base_2.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"

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

/// Insertions, or flips, between two checks of the stop token; about 10 ms.
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

/// Numbers the faces by their lowest site: faces of neighbours are near to each other in memory if
/// the sites are.
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

/// Sides of the hull stay: which sites are its corners does not depend on weights, and a site on
/// one of its sides is hidden only if a side inside proves it.
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

/// From triangles p a b and q b a to p a q and q b p, which take their places; corners 0 and 2 of
/// both then lie opposite to the four outer sides.
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

/// A raised site comes to lie this share of its depth before below the triangle around it, and of
/// the depth that it has without weights, where that is more: far above rounding, so that sites
/// that hide each other by turns come to an end.
constexpr double kDepthKept = 0.5;
constexpr double kLeastDepth = 1e-6;

/// How far a site's height lies below the plane through those of the triangle around it.
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
  // A flip lowers the lifted surface, so this ends; a side that another flip has moved is met again
  // among the outer sides of that flip.
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
          std::max(kDepthKept * depth.under(before), kLeastDepth * depth.without_weights());
      const double raise = wanted - depth.under(weights);
      if (!std::isfinite(raise)) return false;  // The triangle is too thin to tell.
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

}  // namespace lensforge
