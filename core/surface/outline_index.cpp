// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/surface/outline_index.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/surface/corners.h"

namespace lensforge {
namespace {

using Polygon = std::vector<Eigen::Vector2d>;

/// Weights this close to 0 become 0: the corner is then on a side of the triangle and coincides
/// with the neighbouring triangle's.
constexpr double kOnSide = 1e-12;

double doubled_area(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return cross(b - a, c - a);
}

/// A stretch of a polygon to the left of a line, from one crossing of the line to the next.
struct Chain {
  Polygon points;
  double start = 0.0;  ///< Position along the line.
  double end = 0.0;
};

/// The stretches of a polygon strictly to the left of a → b; one without ends if the whole polygon
/// is.
std::vector<Chain> left_chains(const Polygon& polygon, const Eigen::Vector2d& a,
                               const Eigen::Vector2d& b) {
  const std::size_t n = polygon.size();
  std::vector<double> side(n);
  for (std::size_t k = 0; k < n; ++k) side[k] = doubled_area(a, b, polygon[k]);
  const auto cut = [&](std::size_t k, std::size_t next) -> Eigen::Vector2d {
    return polygon[k] + side[k] / (side[k] - side[next]) * (polygon[next] - polygon[k]);
  };
  const auto along = [&](const Eigen::Vector2d& p) { return (p - a).dot(b - a); };
  std::vector<Chain> chains;
  std::size_t first = 0;
  while (first < n && side[first] > 0.0) ++first;
  if (first == n) return {Chain{polygon, 0.0, 0.0}};
  for (std::size_t step = 0; step < n; ++step) {
    const std::size_t k = (first + step) % n;
    const std::size_t next = (k + 1) % n;
    const bool here = side[k] > 0.0;
    const bool there = side[next] > 0.0;
    if (here) chains.back().points.push_back(polygon[k]);
    if (here == there) continue;
    const Eigen::Vector2d p = cut(k, next);
    if (there) chains.push_back({{}, along(p), 0.0});
    if (here) chains.back().end = along(p);
    chains.back().points.push_back(p);
  }
  return chains;
}

/// The parts of a polygon to the left of a → b, counter-clockwise like the polygon. Along the line,
/// ends and starts of stretches alternate: each end connects to the next start.
std::vector<Polygon> left_parts(const Polygon& polygon, const Eigen::Vector2d& a,
                                const Eigen::Vector2d& b) {
  std::vector<Chain> chains = left_chains(polygon, a, b);
  if (chains.size() == 1) return {std::move(chains.front().points)};
  std::vector<std::size_t> starts(chains.size());
  std::iota(starts.begin(), starts.end(), std::size_t{0});
  std::vector<std::size_t> ends = starts;
  std::sort(starts.begin(), starts.end(),
            [&](std::size_t i, std::size_t j) { return chains[i].start < chains[j].start; });
  std::sort(ends.begin(), ends.end(),
            [&](std::size_t i, std::size_t j) { return chains[i].end < chains[j].end; });
  std::vector<std::size_t> follower(chains.size());
  for (std::size_t k = 0; k < ends.size(); ++k) follower[ends[k]] = starts[k];
  std::vector<Polygon> parts;
  std::vector<bool> done(chains.size(), false);
  for (std::size_t k = 0; k < chains.size(); ++k) {
    if (done[k]) continue;
    Polygon part;
    for (std::size_t c = k; !done[c]; c = follower[c]) {
      done[c] = true;
      part.insert(part.end(), chains[c].points.begin(), chains[c].points.end());
    }
    parts.push_back(std::move(part));
  }
  return parts;
}

/// The parts of a polygon inside a triangle (Weiler and Atherton, 1977, one side at a time).
std::vector<Polygon> parts_inside(const Polygon& polygon, const PlanTriangle& t) {
  std::vector<Polygon> parts{polygon};
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<Polygon> left;
    for (const Polygon& part : parts) {
      for (Polygon& one : left_parts(part, t[k], t[(k + 1) % 3])) left.push_back(std::move(one));
    }
    parts = std::move(left);
  }
  return parts;
}

Eigen::Vector3d weights_of(const PlanTriangle& t, const Eigen::Vector2d& p) {
  Eigen::Vector3d w(doubled_area(p, t[1], t[2]), doubled_area(p, t[2], t[0]),
                    doubled_area(p, t[0], t[1]));
  w /= doubled_area(t[0], t[1], t[2]);
  for (double& entry : w) entry = entry < kOnSide ? 0.0 : entry;
  return w / w.sum();
}

/// True if no other corner lies in the triangle before, at and after a corner.
bool is_ear(const Polygon& polygon, std::size_t k) {
  const std::size_t n = polygon.size();
  const Eigen::Vector2d& a = polygon[(k + n - 1) % n];
  const Eigen::Vector2d& b = polygon[k];
  const Eigen::Vector2d& c = polygon[(k + 1) % n];
  return std::none_of(polygon.begin(), polygon.end(), [&](const Eigen::Vector2d& p) {
    return p != a && p != b && p != c && doubled_area(a, b, p) >= 0.0 &&
           doubled_area(b, c, p) >= 0.0 && doubled_area(c, a, p) >= 0.0;
  });
}

/// Cuts a polygon into triangles by clipping ears, the largest first, which avoids slivers. @param
/// least  doubled area below which a corner is dropped.
std::vector<PlanTriangle> triangles_of(Polygon polygon, double least) {
  std::vector<PlanTriangle> triangles;
  while (polygon.size() >= 3) {
    const std::size_t n = polygon.size();
    std::size_t best = n;
    double largest = least;
    std::size_t flattest = 0;
    double flat = -1.0;
    for (std::size_t k = 0; k < n; ++k) {
      const double area = doubled_area(polygon[(k + n - 1) % n], polygon[k], polygon[(k + 1) % n]);
      if (flat < 0.0 || std::abs(area) < flat) {
        flat = std::abs(area);
        flattest = k;
      }
      if (area > largest && is_ear(polygon, k)) {
        largest = area;
        best = k;
      }
    }
    if (flat <= least || best == n) {
      polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>(flattest));
      continue;
    }
    triangles.push_back({polygon[(best + n - 1) % n], polygon[best], polygon[(best + 1) % n]});
    polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>(best));
  }
  return triangles;
}

}  // namespace

Eigen::AlignedBox2d box_of(const PlanTriangle& t) {
  Eigen::AlignedBox2d box(t[0]);
  return box.extend(t[1]).extend(t[2]);
}

OutlineIndex::OutlineIndex(const Outline& outline) : points_(outline.points) {
  const auto [least, most] = std::minmax_element(
      points_.begin(), points_.end(),
      [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.y() < b.y(); });
  low_ = least->y();
  slabs_.resize(std::max<std::size_t>(1, points_.size() / 2));
  step_ = (most->y() - low_) / static_cast<double>(slabs_.size());
  for (std::size_t side = 0; side < points_.size(); ++side) {
    const auto [first, last] = std::minmax({slab_of(start(side).y()), slab_of(end(side).y())});
    for (int slab = first; slab <= last; ++slab) {
      slabs_[static_cast<std::size_t>(slab)].push_back(side);
    }
  }
}

int OutlineIndex::slab_of(double y) const {
  const double last = static_cast<double>(slabs_.size()) - 1.0;
  return static_cast<int>(std::clamp(std::floor((y - low_) / step_), 0.0, last));
}

bool OutlineIndex::contains(const Eigen::Vector2d& p) const {
  bool inside = false;
  for (const std::size_t side : slabs_[static_cast<std::size_t>(slab_of(p.y()))]) {
    const Eigen::Vector2d& a = start(side);
    const Eigen::Vector2d& b = end(side);
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    if (p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) inside = !inside;
  }
  return inside;
}

OutlineIndex::Side OutlineIndex::side_of(const Eigen::AlignedBox2d& box) const {
  const int last = slab_of(box.max().y());
  for (int slab = slab_of(box.min().y()); slab <= last; ++slab) {
    for (const std::size_t side : slabs_[static_cast<std::size_t>(slab)]) {
      const Eigen::AlignedBox2d reach(start(side).cwiseMin(end(side)),
                                      start(side).cwiseMax(end(side)));
      if (reach.intersects(box)) return Side::kAcross;
    }
  }
  return contains(box.center()) ? Side::kInside : Side::kOutside;
}

std::vector<TrianglePiece> OutlineIndex::inside(const PlanTriangle& t) const {
  switch (side_of(box_of(t))) {
    case Side::kOutside:
      return {};
    case Side::kInside:
      return {TrianglePiece{}};
    case Side::kAcross:
      break;
  }
  const double whole = doubled_area(t[0], t[1], t[2]);
  std::vector<PlanTriangle> triangles;
  for (Polygon& part : parts_inside(points_, t)) {
    const std::vector<PlanTriangle> some = triangles_of(std::move(part), kLeastShare * whole);
    triangles.insert(triangles.end(), some.begin(), some.end());
  }
  std::vector<TrianglePiece> pieces;
  double sum = 0.0;
  for (const PlanTriangle& one : triangles) {
    TrianglePiece piece;
    for (int k = 0; k < 3; ++k) {
      piece.weights.col(k) = weights_of(t, one[static_cast<std::size_t>(k)]);
    }
    piece.share = piece.weights.determinant();
    if (!(piece.share > kLeastShare)) continue;
    sum += piece.share;
    pieces.push_back(piece);
  }
  if (sum > 1.0 - kLeastShare) return {TrianglePiece{}};
  return pieces;
}

}  // namespace lensforge
