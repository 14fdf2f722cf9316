// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/drop_cutter.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>

#include "cam/contact/ball_cutter.h"
#include "core/compute/scalar.h"
#include "core/error.h"

namespace lensforge {
namespace {

/// A ridge this flat (rad) counts as a seam: rolling over it lifts the ball by R·(1e-8)²/8.
constexpr double kFlatRidge = 1e-8;

/// One side of an edge: the triangle and which of its edges it is.
struct HalfEdge {
  std::int32_t far_vertex = 0;  ///< The edge's larger vertex number.
  std::int32_t corner = 0;      ///< 3·triangle + edge.
};

/// Half-edges grouped by the smaller vertex of their edge, in the order of the triangles.
struct EdgeTable {
  std::vector<std::int64_t> begin;
  std::vector<HalfEdge> halves;
};

std::pair<int, int> edge_vertices(const SurfaceMesh& mesh, std::int64_t triangle, int k) {
  return std::minmax(int{mesh.triangles(k, triangle)}, int{mesh.triangles((k + 1) % 3, triangle)});
}

EdgeTable group_edges(const SurfaceMesh& mesh) {
  EdgeTable table;
  table.begin.assign(static_cast<std::size_t>(mesh.vertex_count()) + 1, 0);
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    for (int k = 0; k < 3; ++k) {
      ++table.begin[static_cast<std::size_t>(edge_vertices(mesh, t, k).first) + 1];
    }
  }
  for (std::size_t v = 1; v < table.begin.size(); ++v) table.begin[v] += table.begin[v - 1];
  std::vector<std::int64_t> next(table.begin.begin(), table.begin.end() - 1);
  table.halves.resize(static_cast<std::size_t>(3 * mesh.triangle_count()));
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto [near, far] = edge_vertices(mesh, t, k);
      const auto place = static_cast<std::size_t>(next[static_cast<std::size_t>(near)]++);
      table.halves[place] = {far, static_cast<std::int32_t>(3 * t + k)};
    }
  }
  return table;
}

/// A triangle as seen from one of its edges: e0 → e1 and the corner across.
struct Wing {
  Eigen::Vector3d e0, e1, apex;
  Eigen::Vector3d normal;  ///< Unit, upwards.
  bool judged = false;     ///< Neither thin nor steep.
};

Wing make_wing(const SurfaceMesh& mesh, std::int32_t corner) {
  const std::int64_t t = corner / 3;
  const int k = corner % 3;
  Wing wing{mesh.corner(t, k), mesh.corner(t, (k + 1) % 3), mesh.corner(t, (k + 2) % 3), {}, false};
  const Eigen::Vector3d cross = (wing.e0 - wing.apex).cross(wing.e1 - wing.apex);
  const double area2 = cross.norm();
  const double side2 =
      std::max({(wing.e1 - wing.e0).squaredNorm(), (wing.e0 - wing.apex).squaredNorm(),
                (wing.e1 - wing.apex).squaredNorm()});
  if (!(area2 >= kRegularFacet * side2) || !(area2 > 0.0)) return wing;
  wing.normal = (cross.z() < 0.0 ? -cross : cross) / area2;
  wing.judged = wing.normal.z() >= kRegularFacet;
  return wing;
}

double side_of_edge(const Wing& edge, const Eigen::Vector3d& point) {
  const Eigen::Vector3d u = edge.e1 - edge.e0;
  const Eigen::Vector3d w = point - edge.e0;
  return u.x() * w.y() - u.y() * w.x();
}

/// True if the two triangles lie on either side of their edge, seen from above, and meet in a
/// valley or a flat seam: no plane through the edge has both below it.
bool is_valley(const Wing& left, const Wing& right) {
  if (!left.judged || !right.judged) return false;
  if (side_of_edge(left, left.apex) * side_of_edge(left, right.apex) >= 0.0) return false;
  const Eigen::Vector3d u = left.e1 - left.e0;
  const Eigen::Vector3d w = right.apex - left.e0;
  const double reach = u.cross(w).norm() / u.norm();
  return left.normal.dot(w) > -kFlatRidge * reach;
}

/// One of the half-edges begin … end − 1 of a table with the same far vertex as half-edge i, and
/// how many there are; `end` and 0 if there is none.
std::pair<std::size_t, int> partner(const EdgeTable& table, std::size_t i, std::size_t begin,
                                    std::size_t end) {
  std::pair<std::size_t, int> found{end, 0};
  for (std::size_t j = begin; j < end; ++j) {
    if (j == i || table.halves[j].far_vertex != table.halves[i].far_vertex) continue;
    found = {j, found.second + 1};
  }
  return found;
}

/// Marks the half-edges to be tried among those whose smaller vertex is v.
struct KeepEdges {
  const SurfaceMesh& mesh;
  const EdgeTable& table;
  std::vector<std::uint8_t>& kept;  ///< One per half-edge, 3·triangle + k.

  void operator()(std::int64_t v) const {
    const auto begin = static_cast<std::size_t>(table.begin[static_cast<std::size_t>(v)]);
    const auto end = static_cast<std::size_t>(table.begin[static_cast<std::size_t>(v) + 1]);
    for (std::size_t i = begin; i < end; ++i) {
      const HalfEdge& half = table.halves[i];
      if (half.far_vertex == v || partner(table, i, begin, i).second > 0) continue;
      const auto [other, count] = partner(table, i, begin, end);
      const bool valley = count == 1 && is_valley(make_wing(mesh, half.corner),
                                                  make_wing(mesh, table.halves[other].corner));
      if (!valley) kept[static_cast<std::size_t>(half.corner)] = 1;
    }
  }
};

}  // namespace

std::vector<ContactFeatures> contact_features(const SurfaceMesh& mesh, const Executor& executor) {
  const auto triangles = static_cast<std::size_t>(mesh.triangle_count());
  const EdgeTable table = group_edges(mesh);
  std::vector<std::uint8_t> kept(3 * triangles, 0);
  parallel_for(executor, "contact features", mesh.vertex_count(), KeepEdges{mesh, table, kept});

  std::vector<ContactFeatures> features(triangles, 0);
  std::vector<bool> owned(static_cast<std::size_t>(mesh.vertex_count()), false);
  for (std::size_t t = 0; t < triangles; ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto corner = static_cast<std::size_t>(k);
      const auto v = static_cast<std::size_t>(mesh.triangles(k, static_cast<std::int64_t>(t)));
      if (kept[3 * t + corner] != 0) features[t] |= edge_bit(k);
      if (!owned[v]) features[t] |= corner_bit(k);
      owned[v] = true;
    }
  }
  return features;
}

namespace {

/// Boxes are this much larger than their triangles, mm: far above the rounding of a height, so that
/// skipping a triangle never changes a bit of the result, and far below anything it could save.
constexpr double kReachMargin = 1e-6;

/// Minimum cell size of the finest grid, as a share of the radius. On triangles of R/8 a row is
/// fastest with 0.25 R; 0.125 R and 0.75 R take two fifths longer.
constexpr double kCellPerRadius = 0.25;

/// Cells are this much larger than nine tenths of the triangles, so that rounding cannot send some
/// of a set of equal triangles to a second grid.
constexpr double kCellPerTriangle = 1.001;

/// Maximum cells of a grid per triangle; beyond it cells grow, which bounds memory.
constexpr double kCellsPerTriangle = 4.0;

Eigen::AlignedBox3d bounds_of(const SurfaceMesh& mesh, std::int64_t triangle) {
  Eigen::AlignedBox3d box(mesh.corner(triangle, 0));
  box.extend(mesh.corner(triangle, 1));
  box.extend(mesh.corner(triangle, 2));
  return box;
}

double extent(const Eigen::AlignedBox3d& box) { return box.sizes().head<2>().maxCoeff(); }

ContactFeatures rotate_features(ContactFeatures features, int first) {
  ContactFeatures rotated = 0;
  for (int k = 0; k < 3; ++k) {
    if ((features & edge_bit((k + first) % 3)) != 0) rotated |= edge_bit(k);
    if ((features & corner_bit((k + first) % 3)) != 0) rotated |= corner_bit(k);
  }
  return rotated;
}

}  // namespace

/// State of one drop. Local coordinates are relative to the lowest corner of the mesh's box.
struct DropCutter::Search {
  Eigen::Vector2d p;
  double x, y;  ///< p, local.
  double z_origin;
  double radius, radius2;
  CutterLocation best{};
  double best_centre = kNoContact;  ///< Height of the best ball's centre, local.

  void offer(double tip, std::int32_t triangle) {
    if (tip < best.tip || tip == kNoContact) return;
    if (tip == best.tip && triangle >= best.triangle) return;
    best = {tip, triangle};
    best_centre = tip - z_origin + radius;
  }

  /// True if nothing within `reach` can lift the ball: a point at distance d carries the centre to
  /// z_max + √(R² − d²) at most.
  [[nodiscard]] bool out_of(const Reach& reach) const {
    const double dx = std::max({reach.x_min - x, x - reach.x_max, 0.0});
    const double dy = std::max({reach.y_min - y, y - reach.y_max, 0.0});
    const double room = radius2 - (dx * dx + dy * dy);
    const double need = best_centre - reach.z_max;
    return room < 0.0 || (need > 0.0 && need * need > room);
  }
};

CutterLocation DropCutter::drop(const Eigen::Vector2d& p, const CutterLocation& near) const {
  if (levels_.empty()) return {};
  const Eigen::Vector3d& origin = bounds_.min();
  Search search{p, p.x() - origin.x(), p.y() - origin.y(), origin.z(), radius_, radius_ * radius_};
  if (near.rests()) try_item(index_of(item_of_[index_of(near.triangle)]), search);
  for (const Level& level : levels_) search_level(level, search);
  return search.best;
}

void DropCutter::drop(std::span<const Eigen::Vector2d> points, std::span<CutterLocation> locations,
                      const Executor& executor) const {
  LF_CHECK(points.size() == locations.size(), std::to_string(locations.size()));
  constexpr std::int64_t kRun = 256;  // Neighbours in a run pass their location on.
  const auto count = static_cast<std::int64_t>(points.size());
  const auto drop_run = [&](std::int64_t run) {
    CutterLocation last;
    const std::int64_t end = std::min(count, (run + 1) * kRun);
    for (std::int64_t i = run * kRun; i < end; ++i) {
      last = drop(points[index_of(i)], last);
      locations[index_of(i)] = last;
    }
  };
  parallel_for(executor, "drop cutter", (count + kRun - 1) / kRun, drop_run, 1);
}

/// Calls `visit` with the number of every cell whose triangles can lie under a ball with its axis
/// in the box, local coordinates.
template <class Visit>
void DropCutter::visit_cells(const Level& level, const Eigen::AlignedBox2d& axis,
                             const Visit& visit) const {
  const double window = radius_ + 0.5 * level.cell + kReachMargin;
  const auto first = [&](double at) {
    return static_cast<int>(std::max(0.0, std::floor((at - window) / level.cell)));
  };
  const auto last = [&](double at, int cells) {
    return static_cast<int>(std::min(cells - 1.0, std::floor((at + window) / level.cell)));
  };
  const int column_end = last(axis.max().x(), level.columns);
  const int row_end = last(axis.max().y(), level.rows);
  for (int row = first(axis.min().y()); row <= row_end; ++row) {
    const std::size_t row_begin = index_of(row) * index_of(level.columns);
    for (int column = first(axis.min().x()); column <= column_end; ++column) {
      visit(row_begin + index_of(column));
    }
  }
}

/// A lower bound of the tip between two places: the triangle that holds it at one of them would
/// still hold it at the other, and the height on one triangle is concave.
double DropCutter::floor_between(const Eigen::Vector2d& from, const CutterLocation& at_from,
                                 const Eigen::Vector2d& to, const CutterLocation& at_to) const {
  if (!at_from.rests() || !at_to.rests()) return kNoContact;
  const auto held = [&](const CutterLocation& location, const Eigen::Vector2d& other) {
    const std::size_t item = index_of(item_of_[index_of(location.triangle)]);
    return std::min(location.tip, triangle_tip(other, radius_, corners_[item]));
  };
  return std::max(held(at_from, to), held(at_to, from));
}

CutterLocation DropCutter::find_contenders(const Eigen::Vector2d& from,
                                           const CutterLocation& at_from, const Eigen::Vector2d& to,
                                           std::vector<Contender>& contenders) const {
  contenders.clear();
  if (levels_.empty()) return {};
  const CutterLocation at_to = drop(to, at_from);
  const Eigen::Vector3d& origin = bounds_.min();
  Eigen::AlignedBox2d axis(Eigen::Vector2d(from - origin.head<2>()));
  axis.extend(Eigen::Vector2d(to - origin.head<2>()));
  const double centre =
      floor_between(from, at_from, to, at_to) - kReachMargin - origin.z() + radius_;
  const auto out_of = [&](const Reach& reach) {
    const double dx = std::max({reach.x_min - axis.max().x(), axis.min().x() - reach.x_max, 0.0});
    const double dy = std::max({reach.y_min - axis.max().y(), axis.min().y() - reach.y_max, 0.0});
    const double room = radius_ * radius_ - (dx * dx + dy * dy);
    const double need = centre - reach.z_max;
    return room < 0.0 || (need > 0.0 && need * need > room);
  };
  for (const Level& level : levels_) {
    visit_cells(level, axis, [&](std::size_t cell) {
      if (out_of(level.reach[cell])) return;
      for (std::size_t i = index_of(level.begin[cell]); i < index_of(level.begin[cell + 1]); ++i) {
        if (out_of(reach_[i])) continue;
        contenders.push_back({triangle_of_[i], items_[i].features, &items_[i].facet, &corners_[i]});
      }
    });
  }
  std::sort(contenders.begin(), contenders.end(),
            [](const Contender& a, const Contender& b) { return a.triangle < b.triangle; });
  return at_to;
}

void DropCutter::search_level(const Level& level, Search& search) const {
  const Eigen::AlignedBox2d axis(Eigen::Vector2d(search.x, search.y));
  visit_cells(level, axis, [&](std::size_t cell) { search_cell(level, cell, search); });
}

void DropCutter::search_cell(const Level& level, std::size_t cell, Search& search) const {
  if (search.out_of(level.reach[cell])) return;
  const std::size_t end = index_of(level.begin[cell + 1]);
  for (std::size_t item = index_of(level.begin[cell]); item < end; ++item) {
    if (!search.out_of(reach_[item])) try_item(item, search);
  }
}

void DropCutter::try_item(std::size_t item, Search& search) const {
  const FacetContact& facet = items_[item].facet;
  if (facet.shape == FacetShape::kNone) {
    try_boundary(item, {-1.0, -1.0, -1.0}, search);
    return;
  }
  const Barycentric at = contact_point(facet, search.p);
  if (facet.shape == FacetShape::kRegular) {
    if (at.inside()) {
      search.offer(tangent_tip(facet, search.p), triangle_of_[item]);
    } else {
      try_boundary(item, at, search);
    }
    return;
  }
  if (at.inside()) {
    const Eigen::Matrix3d& corners = corners_[item];
    search.offer(tip_at(at, search.p, radius_, corners.col(0), corners.col(1), corners.col(2)),
                 triangle_of_[item]);
  }
  try_boundary(item, {-1.0, -1.0, -1.0}, search);
}

/// Tries the item's own corners, and its own edges with the contact `at` on their far side: f is
/// concave on the triangle, so its maximum lies on one of these.
void DropCutter::try_boundary(std::size_t item, const Barycentric& at, Search& search) const {
  const ContactFeatures features = items_[item].features;
  const Eigen::Matrix3d& corners = corners_[item];
  const double across[3] = {at.c, at.a, at.b};
  for (int k = 0; k < 3; ++k) {
    if ((features & edge_bit(k)) == 0 || across[k] >= 0.0) continue;
    search.offer(edge_tip(search.p, radius_, corners.col(k), corners.col((k + 1) % 3)),
                 triangle_of_[item]);
  }
  for (int k = 0; k < 3; ++k) {
    if ((features & corner_bit(k)) == 0) continue;
    search.offer(vertex_tip(search.p, radius_, corners.col(k)), triangle_of_[item]);
  }
}

namespace {

/// Side of the finest grid's cells: larger than most triangles, not too small against the ball, and
/// limited by the number of triangles.
double finest_cell(std::vector<double> extents, double radius, const Eigen::AlignedBox3d& bounds) {
  const std::size_t most = extents.size() * 9 / 10;
  const auto nth = extents.begin() + static_cast<std::ptrdiff_t>(most);
  std::nth_element(extents.begin(), nth, extents.end());
  const double area = bounds.sizes().x() * bounds.sizes().y();
  const double cells = kCellsPerTriangle * static_cast<double>(extents.size()) + 64.0;
  const double longest_row = bounds.sizes().head<2>().maxCoeff() / cells;
  return std::max(
      {kCellPerTriangle * *nth, kCellPerRadius * radius, std::sqrt(area / cells), longest_row});
}

}  // namespace

DropCutter::DropCutter(const SurfaceMesh& mesh, double radius, const Executor& executor)
    : radius_(radius) {
  LF_CHECK(radius > 0.0, std::to_string(radius));
  const std::int64_t count = mesh.triangle_count();
  if (count == 0) return;
  std::vector<double> extents(index_of(count));
  for (std::int64_t t = 0; t < count; ++t) {
    const Eigen::AlignedBox3d box = bounds_of(mesh, t);
    bounds_.extend(box);
    extents[index_of(t)] = extent(box);
  }
  lay_out_levels(finest_cell(extents, radius_, bounds_),
                 *std::max_element(extents.begin(), extents.end()));
  sort_into_cells(mesh, extents);
  fill_items(mesh, executor);
  bound_cells();
}

void DropCutter::lay_out_levels(double finest_cell, double largest_extent) {
  const Eigen::Vector3d size = bounds_.sizes();
  for (double cell = finest_cell;; cell *= 2.0) {
    Level level;
    level.cell = cell;
    level.columns = static_cast<int>(size.x() / cell) + 1;
    level.rows = static_cast<int>(size.y() / cell) + 1;
    level.begin.assign(index_of(level.columns) * index_of(level.rows) + 1, 0);
    levels_.push_back(std::move(level));
    if (cell >= largest_extent) return;
  }
}

/// Counting sort of the triangles by level and cell; sets Level::begin and the two permutations.
void DropCutter::sort_into_cells(const SurfaceMesh& mesh, const std::vector<double>& extents) {
  struct Place {
    std::uint32_t level;
    std::uint32_t cell;
  };
  std::vector<Place> places(extents.size());
  for (std::size_t t = 0; t < extents.size(); ++t) {
    std::size_t l = 0;
    while (levels_[l].cell < extents[t]) ++l;
    Level& level = levels_[l];
    const Eigen::Vector3d centre =
        bounds_of(mesh, static_cast<std::int64_t>(t)).center() - bounds_.min();
    const auto column = std::min(static_cast<int>(centre.x() / level.cell), level.columns - 1);
    const auto row = std::min(static_cast<int>(centre.y() / level.cell), level.rows - 1);
    const std::size_t cell = index_of(row) * index_of(level.columns) + index_of(column);
    places[t] = {static_cast<std::uint32_t>(l), static_cast<std::uint32_t>(cell)};
    ++level.begin[cell + 1];
  }
  std::int64_t total = 0;
  for (Level& level : levels_) {
    level.begin[0] = total;
    for (std::size_t c = 1; c < level.begin.size(); ++c) level.begin[c] += level.begin[c - 1];
    total = level.begin.back();
  }
  std::vector<std::vector<std::int64_t>> next;
  for (const Level& level : levels_) next.push_back(level.begin);
  triangle_of_.resize(extents.size());
  item_of_.resize(extents.size());
  for (std::size_t t = 0; t < extents.size(); ++t) {
    const std::int64_t item = next[places[t].level][places[t].cell]++;
    triangle_of_[index_of(item)] = static_cast<std::int32_t>(t);
    item_of_[t] = static_cast<std::int32_t>(item);
  }
}

void DropCutter::fill_items(const SurfaceMesh& mesh, const Executor& executor) {
  const std::vector<ContactFeatures> features = contact_features(mesh, executor);
  reach_.resize(features.size());
  items_.resize(features.size());
  corners_.resize(features.size());
  const auto fill = [&](std::int64_t i) {
    const std::size_t item = index_of(i);
    const std::int64_t t = triangle_of_[item];
    Eigen::Matrix3d given;
    given << mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2);
    const int apex = apex_of(given);
    Eigen::Matrix3d& corners = corners_[item];
    corners << given.col(apex), given.col((apex + 1) % 3), given.col((apex + 2) % 3);
    items_[item].facet =
        make_facet_contact(radius_, corners.col(0), corners.col(1), corners.col(2));
    items_[item].features = rotate_features(features[index_of(t)], apex);
    const Eigen::Vector3d low = corners.rowwise().minCoeff() - bounds_.min();
    const Eigen::Vector3d high = corners.rowwise().maxCoeff() - bounds_.min();
    reach_[item] = {float_below(low.x() - kReachMargin), float_above(high.x() + kReachMargin),
                    float_below(low.y() - kReachMargin), float_above(high.y() + kReachMargin),
                    float_above(high.z() + kReachMargin)};
  };
  parallel_for(executor, "drop cutter items", static_cast<std::int64_t>(features.size()), fill);
}

void DropCutter::bound_cells() {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  for (Level& level : levels_) {
    level.reach.assign(level.begin.size() - 1, Reach{kFar, -kFar, kFar, -kFar, -kFar});
    for (std::size_t cell = 0; cell < level.reach.size(); ++cell) {
      Reach& all = level.reach[cell];
      for (std::int64_t item = level.begin[cell]; item < level.begin[cell + 1]; ++item) {
        const Reach& one = reach_[index_of(item)];
        all.x_min = std::min(all.x_min, one.x_min);
        all.x_max = std::max(all.x_max, one.x_max);
        all.y_min = std::min(all.y_min, one.y_min);
        all.y_max = std::max(all.y_max, one.y_max);
        all.z_max = std::max(all.z_max, one.z_max);
      }
    }
  }
}

}  // namespace lensforge
