// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/profile_cutter.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "core/compute/scalar.h"

namespace lensforge {
namespace {

/// The contact is a maximum of f, so an error of 1e-9 rad in it costs 1e-18 of the corner.
constexpr double kAngleTolerance = 1e-9;
/// Halving π/2 this often reaches kAngleTolerance; Newton's method needs about five steps.
constexpr int kMaxSteps = 40;

/// Rounding allowance of the bound from a facet's plane, mm.
constexpr double kBoundMargin = 1e-9;

/// An edge relative to the tool: places on its line are measured uphill from the foot of the axis.
struct EdgeLine {
  double away = 0.0;   ///< Of the line from the axis, seen from above, mm.
  double slope = 0.0;  ///< Rise over run, ≥ 0.
};

/// Angle on the rounded edge, from its lowest point, where it touches the line: the root of
/// h(φ) = sin φ · w − m cos φ, w = √(1 − δ²/t²), t = flat + corner · sin φ, which is
/// f'(σ) = m − g'(t)·σ/t = 0 with g' = tan φ and σ = t·w.
double contact_angle(const CutterProfile& profile, const EdgeLine& line) {
  const auto out_at = [&](double sine) { return profile.flat() + profile.corner * sine; };
  double low = line.away <= profile.flat()
                   ? 0.0
                   : std::asin(std::fmin(1.0, (line.away - profile.flat()) / profile.corner));
  double high = 0.5 * std::numbers::pi;
  double angle = 0.5 * (low + high);
  for (int step = 0; step < kMaxSteps && high - low > kAngleTolerance; ++step) {
    const double sine = std::sin(angle);
    const double cosine = std::cos(angle);
    const double t = out_at(sine);
    const double part = line.away / t;
    const double w = std::sqrt(std::fmax(0.0, (1.0 - part) * (1.0 + part)));
    const double h = sine * w - line.slope * cosine;
    (h > 0.0 ? high : low) = angle;
    const double bend = w > 0.0 ? part * part * profile.corner * cosine / (t * w) : HUGE_VAL;
    const double next = angle - h / (cosine * w + sine * bend + line.slope * sine);
    const bool inside = next > low && next < high;
    if (inside && std::fabs(next - angle) < kAngleTolerance) return next;
    angle = inside ? next : 0.5 * (low + high);
  }
  return angle;
}

/// Place on the line where the tool would rest if the line were long enough, mm uphill from the
/// foot.
double contact_place(const CutterProfile& profile, const EdgeLine& line) {
  double t = profile.radius;
  if (profile.corner > 0.0) {
    if (line.slope == 0.0) return 0.0;
    if (profile.flat() == 0.0) {
      const double part = line.away / profile.radius;
      const double sine2 =
          (part * part + line.slope * line.slope) / (1.0 + line.slope * line.slope);
      t = profile.radius * std::sqrt(sine2);
    } else {
      t = profile.flat() + profile.corner * std::sin(contact_angle(profile, line));
    }
  }
  return std::sqrt(std::fmax(0.0, (t - line.away) * (t + line.away)));
}

/// True if f does not fall uphill of `place` on the line: m − g'(t)·σ/t ≥ 0.
bool rises_at(const CutterProfile& profile, const EdgeLine& line, double place) {
  const double t = std::sqrt(line.away * line.away + place * place);
  const double out = t - profile.flat();
  if (out <= 0.0 || place <= 0.0) return line.slope > 0.0 || place < 0.0;
  const double down = std::sqrt(std::fmax(0.0, (profile.corner - out) * (profile.corner + out)));
  return line.slope * t * down >= out * place;
}

/// Place of the maximum of f between `low` and `high`. Most edges are short and f is monotone.
double best_place(const CutterProfile& profile, const EdgeLine& line, double low, double high) {
  if (rises_at(profile, line, high)) return high;
  if (!rises_at(profile, line, low)) return low;
  return std::fmin(std::fmax(contact_place(profile, line), low), high);
}

/// Barycentric coordinates of the point over (x, y) in the plane of the corners.
Barycentric coordinates(const Eigen::Matrix3d& corners, const Eigen::Vector2d& at) {
  const Eigen::Vector2d u = (corners.col(1) - corners.col(0)).head<2>();
  const Eigen::Vector2d v = (corners.col(2) - corners.col(0)).head<2>();
  const Eigen::Vector2d w = at - corners.col(0).head<2>();
  const double area = u.x() * v.y() - u.y() * v.x();
  const double b = (w.x() * v.y() - w.y() * v.x()) / area;
  const double c = (u.x() * w.y() - u.y() * w.x()) / area;
  return {1.0 - b - c, b, c};
}

/// From this coordinate on the contact certainly lies on the inner side of an edge: rounding.
constexpr double kOnEdge = 1e-9;

/// Result of a facet's tangent contact.
struct FacetTip {
  double tip = kNoContact;
  bool sure = false;    ///< The facet is regular: `tip` and `at` bound the maximum.
  bool inside = false;  ///< `tip` is the maximum over the triangle, else an upper bound.
  Barycentric at{};     ///< The contact in the facet's plane.

  /// True if the maximum can lie on the edge that starts at corner k. If the contact is on the
  /// edge's inner side, f, being concave, rises from every point of the edge towards it, which
  /// leads inside.
  [[nodiscard]] bool may_lie_on_edge(int k) const {
    return !sure || (k == 0 ? at.c : k == 1 ? at.a : at.b) < kOnEdge;
  }
};

/// f at the tangent contact of the facet's plane: the tool touches a plane of normal n at
/// flat · n_xy/|n_xy| + corner · n_xy before its axis. Where that is inside, f is evaluated at a
/// point of the triangle, so never above the true maximum.
FacetTip facet_contact(const CutterProfile& profile, const Eigen::Vector2d& p,
                       const Eigen::Matrix3d& corners) {
  const Eigen::Vector3d u = corners.col(1) - corners.col(0);
  const Eigen::Vector3d v = corners.col(2) - corners.col(0);
  const Eigen::Vector3d cross = u.cross(v);
  const double area2 = cross.norm();
  const double side2 =
      std::fmax((v - u).squaredNorm(), std::fmax(u.squaredNorm(), v.squaredNorm()));
  if (!(area2 > kThinnestFacet * side2)) return {};
  const Eigen::Vector3d n = (cross.z() < 0.0 ? -cross : cross) / area2;
  if (!(n.z() > kVerticalFacet)) return {};
  const double level = n.head<2>().norm();
  Eigen::Vector2d contact = p - profile.corner * n.head<2>();
  if (level > 0.0) contact -= (profile.flat() / level) * n.head<2>();
  FacetTip facet;
  facet.at = coordinates(corners, contact);
  facet.sure = n.z() >= kRegularFacet && area2 >= kRegularFacet * side2;
  facet.inside = facet.at.inside();
  if (!facet.inside && !facet.sure) return facet;
  const double b = facet.inside ? std::fmin(std::fmax(facet.at.b, 0.0), 1.0) : facet.at.b;
  const double c = facet.inside ? std::fmin(std::fmax(facet.at.c, 0.0), 1.0 - b) : facet.at.c;
  const Eigen::Vector3d q = corners.col(0) + b * u + c * v;
  const double away = std::fmin((q.head<2>() - p).norm(), profile.radius);
  facet.tip = q.z() - profile.height(away);
  return facet;
}

}  // namespace

double profile_vertex_tip(const CutterProfile& profile, const Eigen::Vector2d& p,
                          const Eigen::Vector3d& q) {
  const double away = (q.head<2>() - p).norm();
  return away <= profile.radius ? q.z() - profile.height(away) : kNoContact;
}

double profile_edge_tip(const CutterProfile& profile, const Eigen::Vector2d& p,
                        const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d& foot = a.z() <= b.z() ? a : b;
  const Eigen::Vector3d u = (a.z() <= b.z() ? b : a) - foot;
  const double run = u.head<2>().norm();
  if (!(run > 0.0)) return profile_vertex_tip(profile, p, foot + u);
  const Eigen::Vector2d w = p - foot.head<2>();
  const EdgeLine line{std::fabs(u.x() * w.y() - u.y() * w.x()) / run, u.z() / run};
  if (line.away > profile.radius) return kNoContact;
  const double reach = std::sqrt((profile.radius - line.away) * (profile.radius + line.away));
  const double begin = -(u.x() * w.x() + u.y() * w.y()) / run;
  const double low = std::fmax(begin, -reach);
  const double high = std::fmin(begin + run, reach);
  if (low > high) return kNoContact;
  const double place = best_place(profile, line, low, high);
  const double part = std::fmin(std::fmax((place - begin) / run, 0.0), 1.0);
  const double away = std::fmin(std::sqrt(line.away * line.away + place * place), profile.radius);
  return foot.z() + part * u.z() - profile.height(away);
}

double profile_triangle_tip(const CutterProfile& profile, const Eigen::Vector2d& p,
                            const Eigen::Matrix3d& corners, double enough) {
  const FacetTip facet = facet_contact(profile, p, corners);
  if (facet.sure && (facet.inside || facet.tip < enough - kBoundMargin)) return facet.tip;
  double best = facet.inside ? facet.tip : kNoContact;
  for (int k = 0; k < 3; ++k) {
    if (!facet.may_lie_on_edge(k)) continue;
    best = std::fmax(best, profile_edge_tip(profile, p, corners.col(k), corners.col((k + 1) % 3)));
  }
  return best;
}

double profile_box_tip(const CutterProfile& profile, const Eigen::Vector2d& p,
                       const Eigen::AlignedBox3d& box) {
  const Eigen::Vector2d near = p.cwiseMax(box.min().head<2>()).cwiseMin(box.max().head<2>());
  const double away = (near - p).norm();
  return away <= profile.radius ? box.max().z() - profile.height(away) : kNoContact;
}

namespace {

/// Cells per triangle: with two triangles per cell the pyramid is as small as the items.
constexpr double kPyramidCells = 0.5;

}  // namespace

/// State of one drop. Local coordinates are relative to the lowest corner of the mesh's box.
struct ProfileCutter::Search {
  const CutterProfile& profile;
  Eigen::Vector2d p;
  double x, y;  ///< p, local.
  CutterLocation best{};

  void offer(double tip, std::int32_t triangle) {
    if (tip > best.tip) best = {tip, triangle};
  }

  /// Upper bound of the tip for anything in the box.
  [[nodiscard]] double most(const Node& box) const {
    const double dx = std::max({box.x_min - x, x - box.x_max, 0.0});
    const double dy = std::max({box.y_min - y, y - box.y_max, 0.0});
    return box.z_max - profile.height(std::sqrt(dx * dx + dy * dy));
  }

  /// Lower bound of the tip from the box's highest point, wherever it is in the box.
  [[nodiscard]] double least(const Node& box) const {
    const double dx = std::max(x - box.x_min, box.x_max - x);
    const double dy = std::max(y - box.y_min, box.y_max - y);
    return box.z_max - profile.height(std::sqrt(dx * dx + dy * dy));
  }
};

ProfileCutter::ProfileCutter(const SurfaceMesh& mesh) {
  const std::int64_t count = mesh.triangle_count();
  if (count == 0) return;
  for (std::int64_t t = 0; t < count; ++t) {
    for (int k = 0; k < 3; ++k) bounds_.extend(mesh.corner(t, k));
  }
  const Eigen::Vector2d size = bounds_.sizes().head<2>();
  const double cells = kPyramidCells * static_cast<double>(count) + 1.0;
  const double cell = std::max(std::sqrt(size.prod() / cells), size.maxCoeff() / cells);
  sort_into_cells(mesh, cell > 0.0 ? cell : 1.0);
  build_pyramid();
}

/// Counting sort of the triangles by the cell of their boxes' centres.
void ProfileCutter::sort_into_cells(const SurfaceMesh& mesh, double cell) {
  const auto count = index_of(mesh.triangle_count());
  const Eigen::Vector3d size = bounds_.sizes();
  Level cells{static_cast<int>(size.x() / cell) + 1, static_cast<int>(size.y() / cell) + 1, {}};
  begin_.assign(index_of(cells.columns) * index_of(cells.rows) + 1, 0);
  std::vector<std::size_t> cell_of(count);
  for (std::size_t t = 0; t < count; ++t) {
    Eigen::AlignedBox3d box;
    for (int k = 0; k < 3; ++k) box.extend(mesh.corner(static_cast<std::int64_t>(t), k));
    const Eigen::Vector3d centre = box.center() - bounds_.min();
    const int column = std::min(static_cast<int>(centre.x() / cell), cells.columns - 1);
    const int row = std::min(static_cast<int>(centre.y() / cell), cells.rows - 1);
    cell_of[t] = index_of(row) * index_of(cells.columns) + index_of(column);
    ++begin_[cell_of[t] + 1];
  }
  for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
  std::vector<std::int64_t> next(begin_.begin(), begin_.end() - 1);
  boxes_.resize(count);
  corners_.resize(count);
  triangle_of_.resize(count);
  item_of_.resize(count);
  for (std::size_t t = 0; t < count; ++t) {
    const auto item = index_of(next[cell_of[t]]++);
    const auto triangle = static_cast<std::int64_t>(t);
    Eigen::Matrix3d& corners = corners_[item];
    corners << mesh.corner(triangle, 0), mesh.corner(triangle, 1), mesh.corner(triangle, 2);
    const Eigen::Vector3d low = corners.rowwise().minCoeff() - bounds_.min();
    const Eigen::Vector3d high = corners.rowwise().maxCoeff() - bounds_.min();
    boxes_[item] = {
        float_below(low.x()),  float_above(high.x()),           float_below(low.y()),
        float_above(high.y()), static_cast<std::int32_t>(item), corners.row(2).maxCoeff()};
    triangle_of_[item] = static_cast<std::int32_t>(t);
    item_of_[t] = static_cast<std::int32_t>(item);
  }
  levels_.push_back(std::move(cells));
}

void ProfileCutter::build_pyramid() {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  constexpr Node kEmpty{kFar, -kFar, kFar, -kFar, -1, kNoContact};
  const auto include = [](Node& all, const Node& one) {
    all.x_min = std::min(all.x_min, one.x_min);
    all.x_max = std::max(all.x_max, one.x_max);
    all.y_min = std::min(all.y_min, one.y_min);
    all.y_max = std::max(all.y_max, one.y_max);
    if (one.z_max > all.z_max) {
      all.z_max = one.z_max;
      all.top = one.top;
    }
  };
  levels_[0].nodes.assign(begin_.size() - 1, kEmpty);
  for (std::size_t cell = 0; cell + 1 < begin_.size(); ++cell) {
    for (std::int64_t item = begin_[cell]; item < begin_[cell + 1]; ++item) {
      include(levels_[0].nodes[cell], boxes_[index_of(item)]);
    }
  }
  while (levels_.back().nodes.size() > 1) {
    const Level& fine = levels_.back();
    Level coarse{(fine.columns + 1) / 2, (fine.rows + 1) / 2, {}};
    coarse.nodes.assign(index_of(coarse.columns) * index_of(coarse.rows), kEmpty);
    for (int row = 0; row < fine.rows; ++row) {
      for (int column = 0; column < fine.columns; ++column) {
        const auto from = index_of(row) * index_of(fine.columns) + index_of(column);
        const auto to = index_of(row / 2) * index_of(coarse.columns) + index_of(column / 2);
        include(coarse.nodes[to], fine.nodes[from]);
      }
    }
    levels_.push_back(std::move(coarse));
  }
}

CutterLocation ProfileCutter::drop(const CutterProfile& profile, const Eigen::Vector2d& p,
                                   const CutterLocation& near) const {
  if (levels_.empty()) return {};
  Search search{profile, p, p.x() - bounds_.min().x(), p.y() - bounds_.min().y()};
  if (near.rests()) try_item(item_of_[index_of(near.triangle)], search);
  if (search.most(levels_.back().nodes[0]) > search.best.tip) {
    search_node(levels_.size() - 1, 0, 0, search);
  }
  return search.best;
}

double ProfileCutter::rest_on(const CutterProfile& profile, const Eigen::Vector2d& p,
                              const CutterLocation& near) const {
  if (!near.rests()) return kNoContact;
  const std::int32_t item = item_of_[index_of(near.triangle)];
  return profile_triangle_tip(profile, p, corners_[index_of(item)]);
}

void ProfileCutter::search_node(std::size_t level, int column, int row, Search& search) const {
  if (level == 0) {
    search_cell(index_of(row) * index_of(levels_[0].columns) + index_of(column), search);
    return;
  }
  struct Child {
    double most;
    int column, row;
  };
  std::array<Child, 4> children{};
  std::size_t count = 0;
  const Level& below_it = levels_[level - 1];
  for (int k = 0; k < 4; ++k) {
    const int c = 2 * column + k % 2;
    const int r = 2 * row + k / 2;
    if (c >= below_it.columns || r >= below_it.rows) continue;
    const Node& node = below_it.nodes[index_of(r) * index_of(below_it.columns) + index_of(c)];
    const double most = search.most(node);
    if (!(most > search.best.tip)) continue;
    const double least = search.least(node);
    if (least > search.best.tip) search.offer(least, triangle_of_[index_of(node.top)]);
    std::size_t place = count++;  // The most promising first.
    for (; place > 0 && children[place - 1].most < most; --place) {
      children[place] = children[place - 1];
    }
    children[place] = {most, c, r};
  }
  for (std::size_t k = 0; k < count; ++k) {
    if (!(children[k].most > search.best.tip)) return;
    search_node(level - 1, children[k].column, children[k].row, search);
  }
}

void ProfileCutter::search_cell(std::size_t cell, Search& search) const {
  for (std::int64_t item = begin_[cell]; item < begin_[cell + 1]; ++item) {
    if (search.most(boxes_[index_of(item)]) > search.best.tip) try_item(item, search);
  }
}

void ProfileCutter::try_item(std::int64_t item, Search& search) const {
  search.offer(
      profile_triangle_tip(search.profile, search.p, corners_[index_of(item)], search.best.tip),
      triangle_of_[index_of(item)]);
}

TipFloor::TipFloor(const ProfileCutter& surface, const Tool& tool, double allowance,
                   std::span<const KeepOut> keep_outs, double clearance)
    : surface_(surface),
      rim_(surface.bounds().min().head<2>(), surface.bounds().max().head<2>()),
      keep_outs_(keep_outs),
      clearance_(clearance),
      hold_(hold_of(tool, allowance)) {
  for (const CutterProfile& part : whole_profile(tool)) {
    parts_.push_back(grown(part, allowance));
    whole_.push_back(widened(part, clearance));
  }
}

TipFloor::TipFloor(const ProfileCutter& surface, const Tool& tool, double allowance,
                   const Eigen::AlignedBox2d& rim)
    : TipFloor(surface, tool, allowance, {}, 0.0) {
  rim_ = rim;
}

double TipFloor::hold_of(const Tool& tool, double allowance) {
  const CutterProfile cutter = grown(whole_profile(tool).front(), allowance);
  return cutter.flat() + cutter.corner / std::numbers::sqrt2;
}

/// The place whose height the tip keeps over p.
Eigen::Vector2d TipFloor::held(const Eigen::Vector2d& p) const {
  const Eigen::Vector2d rim = p.cwiseMax(rim_.min()).cwiseMin(rim_.max());
  const double beyond = (p - rim).norm();
  return beyond > hold_ ? rim + (p - rim) * (hold_ / beyond) : p;
}

double TipFloor::at_least(const Eigen::Vector2d& p, const Trace& trace) const {
  const Eigen::Vector2d held = this->held(p);
  double floor = kNoContact;
  for (std::size_t part = 0; part < trace.size(); ++part) {
    floor = std::max(floor, surface_.rest_on(parts_[part], held, trace[part]));
  }
  return floor;
}

double TipFloor::over(const Eigen::Vector2d& p, double reach, Trace& trace) const {
  return std::max(over_surface(p, reach, trace), over_clamps(p, reach));
}

double TipFloor::over_surface(const Eigen::Vector2d& p, double reach, Trace& trace) const {
  trace.resize(parts_.size());
  const Eigen::Vector2d held = this->held(p);
  double floor = kNoContact;
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    // A shank is usually so high that not even the surface's highest point could reach it.
    if (surface_.bounds().max().z() - parts_[part].base <= floor) continue;
    trace[part] = surface_.drop(widened(parts_[part], reach), held, trace[part]);
    floor = std::max(floor, trace[part].tip);
  }
  return floor;
}

double TipFloor::over_clamps(const Eigen::Vector2d& p, double reach) const {
  double floor = kNoContact;
  for (const KeepOut& box : keep_outs_) {
    for (const CutterProfile& part : whole_) {
      const double tip =
          profile_box_tip(widened(part, reach), p, Eigen::AlignedBox3d(box.low, box.high));
      floor = std::max(floor, tip + clearance_);
    }
  }
  return floor;
}

}  // namespace lensforge
