// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/optics/outline.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/compute/executor.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Chords of a full circle: chords are π²/2n² of the radius from the arc.
constexpr int kChords = 1440;

using Polygon = std::vector<Eigen::Vector2d>;

/// Adds the corners of a quarter of a circle, from angle `quarter` · 90° on.
void add_quarter(const Eigen::Vector2d& centre, double radius, int quarter, Polygon& points) {
  constexpr int kOfQuarter = kChords / 4;
  for (int k = 0; k <= kOfQuarter; ++k) {
    const double angle = 2.0 * std::numbers::pi * (quarter * kOfQuarter + k) / kChords;
    points.emplace_back(centre.x() + radius * std::cos(angle),
                        centre.y() + radius * std::sin(angle));
  }
}

/// The polygon without consecutive equal corners.
Polygon without_repeats(Polygon points) {
  points.erase(std::unique(points.begin(), points.end()), points.end());
  while (points.size() > 1 && points.front() == points.back()) points.pop_back();
  return points;
}

/// Side of a → b on which a point lies: −1, 0 or 1.
int side(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p) {
  const double s = cross(b - a, p - a);
  return s > 0.0 ? 1 : (s < 0.0 ? -1 : 0);
}

/// True if p, which lies on the line through a and b, lies between them.
bool between(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& p) {
  return (p.array() >= a.cwiseMin(b).array()).all() && (p.array() <= a.cwiseMax(b).array()).all();
}

bool meet(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
          const Eigen::Vector2d& d) {
  const int ac = side(a, b, c);
  const int ad = side(a, b, d);
  const int ca = side(c, d, a);
  const int cb = side(c, d, b);
  if (ac * ad < 0 && ca * cb < 0) return true;
  return (ac == 0 && between(a, b, c)) || (ad == 0 && between(a, b, d)) ||
         (ca == 0 && between(c, d, a)) || (cb == 0 && between(c, d, b));
}

/// Two sides of a polygon that meet without being neighbours, or that fold back on each other.
std::optional<std::pair<std::size_t, std::size_t>> meeting_sides(const Polygon& points) {
  const std::size_t n = points.size();
  const auto start = [&](std::size_t k) -> const Eigen::Vector2d& { return points[k % n]; };
  const auto least = [&](std::size_t k) { return std::min(start(k).x(), start(k + 1).x()); };
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
    return std::pair(least(i), i) < std::pair(least(j), j);
  });
  for (std::size_t p = 0; p < n; ++p) {
    const std::size_t i = order[p];
    const double end = std::max(start(i).x(), start(i + 1).x());
    for (std::size_t q = p + 1; q < n && least(order[q]) <= end; ++q) {
      const std::size_t j = order[q];
      const bool follows = (i + 1) % n == j;
      const bool leads = (j + 1) % n == i;
      if (follows || leads) {
        const std::size_t k = follows ? j : i;
        const Eigen::Vector2d back = start(k + n - 1) - start(k);
        const Eigen::Vector2d on = start(k + 1) - start(k);
        if (cross(back, on) == 0.0 && back.dot(on) > 0.0) return std::pair(i, j);
      } else if (meet(start(i), start(i + 1), start(j), start(j + 1))) {
        return std::pair(i, j);
      }
    }
  }
  return std::nullopt;
}

std::string place_text(const Eigen::Vector2d& p) {
  return number_text(p.x()) + ", " + number_text(p.y());
}

}  // namespace

double polygon_area(const std::vector<Eigen::Vector2d>& points) {
  double doubled = 0.0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    doubled += cross(points[k] - points.front(), points[(k + 1) % points.size()] - points.front());
  }
  return 0.5 * doubled;
}

Outline circle_outline(const Eigen::Vector2d& size) {
  const double radius = 0.5 * size.minCoeff();
  Polygon points;
  for (int quarter = 0; quarter < 4; ++quarter) {
    add_quarter(0.5 * size, radius, quarter, points);
    points.pop_back();
  }
  return {OutlineKind::kCircle, radius, without_repeats(std::move(points))};
}

Outline rounded_outline(const Eigen::Vector2d& size, double radius) {
  const Eigen::Vector2d low = Eigen::Vector2d::Constant(radius);
  const Eigen::Vector2d high = size - low;
  Polygon points;
  add_quarter(high, radius, 0, points);
  add_quarter({low.x(), high.y()}, radius, 1, points);
  add_quarter(low, radius, 2, points);
  add_quarter({high.x(), low.y()}, radius, 3, points);
  for (Eigen::Vector2d& p : points) p = p.cwiseMax(0.0).cwiseMin(size);
  return {OutlineKind::kRoundedRectangle, radius, without_repeats(std::move(points))};
}

Outline polygon_outline(const Eigen::Vector2d& size, std::vector<Eigen::Vector2d> points) {
  points = without_repeats(std::move(points));
  if (polygon_area(points) < 0.0) std::reverse(points.begin(), points.end());
  Eigen::Vector2d low = points.front();
  Eigen::Vector2d high = low;
  for (const Eigen::Vector2d& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double scale = size.cwiseQuotient(high - low).minCoeff();
  const Eigen::Vector2d from = 0.5 * (low + high);
  for (Eigen::Vector2d& p : points) {
    p = (0.5 * size + scale * (p - from)).cwiseMax(0.0).cwiseMin(size);
  }
  return {OutlineKind::kPolygon, 0.0, std::move(points)};
}

std::string outline_words(const Outline& outline) {
  switch (outline.kind) {
    case OutlineKind::kCircle:
      return "circle of " + number_text(2.0 * outline.radius) + " mm";
    case OutlineKind::kRoundedRectangle:
      return "corners of radius " + number_text(outline.radius) + " mm";
    case OutlineKind::kPolygon:
      break;
  }
  return "polygon of " + std::to_string(outline.points.size()) + " corners, " +
         number_text(polygon_area(outline.points)) + " mm2";
}

std::optional<std::string> polygon_fault(const std::vector<Eigen::Vector2d>& points) {
  if (points.size() < 3 || points.size() > kMaxOutlinePoints) {
    return "it has " + std::to_string(points.size()) + " corners: must have 3 to " +
           std::to_string(kMaxOutlinePoints);
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!points[k].allFinite()) return "corner " + std::to_string(k) + " is not finite";
    if (points[k] == points[(k + 1) % points.size()]) {
      return "corner " + std::to_string(k) + " at " + place_text(points[k]) + " stands twice";
    }
  }
  if (const auto sides = meeting_sides(points)) {
    return "it crosses or touches itself near " + place_text(points[sides->first]) +
           ": must be one closed line";
  }
  if (!(std::abs(polygon_area(points)) > 0.0)) return "it has no area";
  return std::nullopt;
}

namespace {

/// Weights this close to 0 become 0: the corner is then on a side of the triangle and coincides
/// with the neighbouring triangle's.
constexpr double kOnCorner = 1e-12;

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
  for (double& entry : w) entry = entry < kOnCorner ? 0.0 : entry;
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
    const std::vector<PlanTriangle> some = triangles_of(std::move(part), kMinShare * whole);
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
    if (!(piece.share > kMinShare)) continue;
    sum += piece.share;
    pieces.push_back(piece);
  }
  if (sum > 1.0 - kMinShare) return {TrianglePiece{}};
  return pieces;
}

namespace {

/// Corners on one edge of the mesh closer than this share of it are merged.
constexpr double kSameCorner = 1e-9;

/// Minimum triangles per task: each is clipped against the whole outline.
constexpr std::int64_t kClipGrain = 16;

PlanTriangle plan_of(const SurfaceMesh& mesh, std::int64_t face) {
  return {mesh.corner(face, 0).head<2>(), mesh.corner(face, 1).head<2>(),
          mesh.corner(face, 2).head<2>()};
}

bool is_whole(const std::vector<TrianglePiece>& pieces) {
  return pieces.size() == 1 && pieces.front().share == 1.0;
}

/// Collects the corners and triangles of the part.
class PartBuilder {
 public:
  PartBuilder(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals)
      : mesh_(mesh),
        normals_(normals),
        kept_(static_cast<std::size_t>(mesh.vertex_count()), kNone) {}

  void add(std::int64_t face, const Eigen::Matrix3d& weights) {
    if (face != face_) inside_.clear();
    face_ = face;
    Eigen::Vector3i corners;
    for (int k = 0; k < 3; ++k) corners[k] = corner(mesh_.triangles.col(face), weights.col(k));
    const bool flat =
        corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0];
    if (!flat) triangles_.push_back(corners);
  }

  [[nodiscard]] SampledSurface finish() const {
    SampledSurface part;
    const auto count = static_cast<Eigen::Index>(places_.size());
    part.mesh.vertices.resize(3, count);
    part.normals.resize(3, count);
    for (Eigen::Index v = 0; v < count; ++v) {
      part.mesh.vertices.col(v) = places_[static_cast<std::size_t>(v)];
      part.normals.col(v) = directions_[static_cast<std::size_t>(v)];
    }
    part.mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles_.size()));
    for (Eigen::Index t = 0; t < part.mesh.triangles.cols(); ++t) {
      part.mesh.triangles.col(t) = triangles_[static_cast<std::size_t>(t)];
    }
    return part;
  }

 private:
  static constexpr int kNone = -1;

  /// Number in the part of a piece's corner.
  int corner(const Eigen::Vector3i& face, const Eigen::Vector3d& weights) {
    const auto zeros = (weights.array() == 0.0).count();
    Eigen::Index largest = 0;
    weights.maxCoeff(&largest);
    if (zeros == 2) {
      int& number = kept_[static_cast<std::size_t>(face[largest])];
      if (number == kNone) number = append(face, weights);
      return number;
    }
    return zeros == 0 ? in_face(face, weights) : on_edge(face, weights);
  }

  /// Shared by all pieces of a face.
  int in_face(const Eigen::Vector3i& face, const Eigen::Vector3d& weights) {
    for (const auto& [known, number] : inside_) {
      if (known == weights) return number;
    }
    inside_.emplace_back(weights, append(face, weights));
    return inside_.back().second;
  }

  /// Shared by both sides of an edge.
  int on_edge(const Eigen::Vector3i& face, const Eigen::Vector3d& weights) {
    int a = weights[0] == 0.0 ? 1 : 0;
    int b = weights[2] == 0.0 ? 1 : 2;
    if (face[a] > face[b]) std::swap(a, b);
    auto& corners = edges_[{face[a], face[b]}];
    for (const auto& [share, number] : corners) {
      if (std::abs(share - weights[b]) <= kSameCorner) return number;
    }
    corners.emplace_back(weights[b], append(face, weights));
    return corners.back().second;
  }

  int append(const Eigen::Vector3i& face, const Eigen::Vector3d& weights) {
    Eigen::Vector3d place(0.0, 0.0, 0.0);
    Eigen::Vector3d direction(0.0, 0.0, 0.0);
    for (int k = 0; k < 3; ++k) {
      if (weights[k] == 0.0) continue;
      place += weights[k] * mesh_.vertices.col(face[k]);
      direction += weights[k] * normals_.col(face[k]).normalized();
    }
    places_.push_back(place);
    directions_.emplace_back(direction.normalized());
    return static_cast<int>(places_.size()) - 1;
  }

  const SurfaceMesh& mesh_;
  const Eigen::Matrix3Xd& normals_;
  std::vector<int> kept_;  ///< Number in the part of each vertex of the mesh.
  std::map<std::pair<int, int>, std::vector<std::pair<double, int>>> edges_;
  std::int64_t face_ = -1;                               ///< Face of the last piece added.
  std::vector<std::pair<Eigen::Vector3d, int>> inside_;  ///< Corners inside that face.
  std::vector<Eigen::Vector3d> places_;
  std::vector<Eigen::Vector3d> directions_;
  std::vector<Eigen::Vector3i> triangles_;
};

}  // namespace

MeshCut cut_mesh(const SurfaceMesh& mesh, const Outline& outline, const Executor& executor) {
  const OutlineIndex index(outline);
  std::vector<OutlineIndex::Side> sides(static_cast<std::size_t>(mesh.triangle_count()));
  parallel_for(executor, "find rim", mesh.triangle_count(), [&](std::int64_t f) {
    sides[static_cast<std::size_t>(f)] = index.side_of(box_of(plan_of(mesh, f)));
  });
  std::vector<std::int64_t> rim;
  for (std::size_t f = 0; f < sides.size(); ++f) {
    if (sides[f] == OutlineIndex::Side::kAcross) rim.push_back(static_cast<std::int64_t>(f));
  }
  std::vector<std::vector<TrianglePiece>> pieces(rim.size());
  parallel_for(
      executor, "cut triangles", std::ssize(rim),
      [&](std::int64_t k) {
        const auto at = static_cast<std::size_t>(k);
        pieces[at] = index.inside(plan_of(mesh, rim[at]));
      },
      kClipGrain);
  MeshCut cut;
  std::size_t next = 0;
  for (std::size_t f = 0; f < sides.size(); ++f) {
    const bool on_rim = sides[f] == OutlineIndex::Side::kAcross;
    const std::vector<TrianglePiece>* const parts = on_rim ? &pieces[next++] : nullptr;
    const bool whole =
        parts != nullptr ? is_whole(*parts) : sides[f] == OutlineIndex::Side::kInside;
    cut.first.push_back(whole ? MeshCut::kWhole : static_cast<std::int32_t>(cut.pieces.size()));
    cut.share.push_back(whole ? 1.0 : 0.0);
    if (whole || parts == nullptr) continue;
    for (const TrianglePiece& piece : *parts) {
      cut.pieces.push_back({static_cast<std::int64_t>(f), piece});
      cut.share.back() += piece.share;
    }
  }
  cut.pieces.emplace_back();
  return cut;
}

SampledSurface part_inside(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                           const MeshCut& cut) {
  PartBuilder part(mesh, normals);
  for (std::int64_t f = 0; f < mesh.triangle_count(); ++f) {
    const std::int32_t first = cut.first[static_cast<std::size_t>(f)];
    if (first == MeshCut::kWhole) {
      part.add(f, Eigen::Matrix3d::Identity());
      continue;
    }
    for (auto k = static_cast<std::size_t>(first); cut.pieces[k].face == f; ++k) {
      part.add(f, cut.pieces[k].piece.weights);
    }
  }
  return part.finish();
}

}  // namespace lensforge
