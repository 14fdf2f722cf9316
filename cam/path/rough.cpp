// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/rough.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "cam/contact/profile_cutter.h"
#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

constexpr std::size_t kHeld = 4096;  ///< Moves passed on at a time.

}  // namespace

RoughMoves::RoughMoves(const Tool& tool, StockMap& stock, const MoveSink& sink,
                       OperationSummary& summary)
    : tool_(tool), profile_(cutting_profile(tool)), stock_(stock), sink_(sink), summary_(summary) {}

void RoughMoves::rapid(const Eigen::Vector3d& end) {
  if (placed_) summary_.rapid_length += (end - at_).norm();
  push({MoveKind::kRapid, end});
}

void RoughMoves::feed(MoveKind kind, const Eigen::Vector3d& end) {
  PathMove move{kind, end};
  move.feed = kind == MoveKind::kPlunge ? tool_.plunge : tool_.feed;
  const Extreme depth = stock_.cut(profile_, at_, end).deepest;
  if (depth.value > deepest_.value) deepest_ = depth;
  summary_.cutting_length += (end - at_).norm();
  summary_.tip.extend(at_);
  summary_.tip.extend(end);
  push(move);
}

void RoughMoves::push(const PathMove& move) {
  held_.push_back(move);
  ++summary_.moves;
  at_ = move.end;
  placed_ = true;
  if (held_.size() >= kHeld) flush();
}

void RoughMoves::flush() {
  if (!held_.empty()) sink_(held_);
  held_.clear();
}

namespace {

/// Maximum height of chords above the nodes, as a share of the spacing: on slopes a tenth of the
/// cost of sampling the surface at intervals.
constexpr double kChordShare = 0.1;

/// Thinner material is due to rounding of heights.
constexpr double kNothing = 1e-9;

std::int64_t intervals(double length, double step) {
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(length / step - 1e-9)));
}

}  // namespace

PassGrid::PassGrid(const TipFloor& floor, const PassLayout& layout, const Executor& executor,
                   const RunControl& control)
    : layout_(layout) {
  const int along = layout.along == PassAxis::kX ? 0 : 1;
  const Eigen::Vector2d size = layout.area.sizes();
  passes_ = intervals(size[1 - along], layout.stepover) + 1;
  count_ = intervals(size[along], layout.spacing) + 1;
  stepover_ = size[1 - along] / static_cast<double>(passes_ - 1);
  spacing_ = size[along] / static_cast<double>(count_ - 1);
  nodes_.resize(static_cast<std::size_t>(passes_ * count_));
  if (floor.has_clamps()) ground_.resize(nodes_.size());
  excess_.resize(static_cast<std::size_t>(passes_));
  const auto fill_pass = [&](std::int64_t pass) {
    if (!control.stop_requested()) fill(pass, floor);
  };
  parallel_for(executor, "tip floor", passes_, fill_pass, 1);
  if (control.stop_requested()) throw Interrupted();
}

Eigen::Vector2d PassGrid::place(std::int64_t pass, double node) const {
  const double forward = spacing_ * node;
  const double aside = stepover_ * static_cast<double>(pass);
  return layout_.area.min() + (layout_.along == PassAxis::kX ? Eigen::Vector2d(forward, aside)
                                                             : Eigen::Vector2d(aside, forward));
}

void PassGrid::fill(std::int64_t pass, const TipFloor& floor) {
  const auto first = static_cast<std::size_t>(pass * count_);
  double* const nodes = &nodes_[first];
  Extreme& excess = excess_[static_cast<std::size_t>(pass)];
  TipFloor::Trace trace;
  double before = kNoContact;
  double ground_before = kNoContact;
  for (std::int64_t i = 0; i < count_; ++i) {
    const auto at = static_cast<double>(i);
    double ground = kNoContact;
    double after = kNoContact;
    if (i + 1 < count_) {
      const Eigen::Vector2d middle = place(pass, at + 0.5);
      ground = floor.over_surface(middle, 0.5 * spacing_, trace);
      after = std::max(ground, floor.over_clamps(middle, 0.5 * spacing_));
    }
    nodes[i] = std::max(before, after);
    if (!ground_.empty()) {
      ground_[first + static_cast<std::size_t>(i)] = std::max(ground_before, ground);
      ground_before = ground;
    }
    const Eigen::Vector2d p = place(pass, at);
    // The floor itself is computed only where it can be the maximum.
    if (nodes[i] - floor.at_least(p, trace) > excess.value) {
      const double above = nodes[i] - floor.over(p, 0.0, trace);
      if (above > excess.value) excess = {above, {p.x(), p.y(), nodes[i]}};
    }
    before = after;
  }
}

double PassGrid::lowest() const { return *std::min_element(nodes_.begin(), nodes_.end()); }

Extreme PassGrid::excess() const {
  const auto less = [](const Extreme& a, const Extreme& b) { return a.value < b.value; };
  return *std::max_element(excess_.begin(), excess_.end(), less);
}

std::vector<PassPart> PassGrid::parts(std::int64_t pass, double level, double previous) const {
  const auto cuts = [&](std::int64_t i) {
    return node(pass, i) < previous - kNothing &&
           layout_.material.contains(place(pass, static_cast<double>(i)));
  };
  std::vector<PassPart> all;
  for (std::int64_t i = 0; i < count_; ++i) {
    if (!cuts(i)) continue;
    std::int64_t end = i;
    while (end + 1 < count_ && cuts(end + 1)) ++end;
    const std::int64_t first = std::max<std::int64_t>(0, i - 1);
    const std::int64_t last = std::min(count_ - 1, end + 1);
    divide(pass, first, last, level, previous, all);
    i = end;
  }
  return all;
}

/// True if a clamp keeps the tip above level and surface.
bool PassGrid::lifted(std::int64_t pass, std::int64_t i, double level) const {
  if (ground_.empty()) return false;
  const double ground = ground_[static_cast<std::size_t>(pass * count_ + i)];
  return node(pass, i) > std::max(level, ground) + kNothing;
}

void PassGrid::divide(std::int64_t pass, std::int64_t begin, std::int64_t end, double level,
                      double previous, std::vector<PassPart>& parts) const {
  for (std::int64_t i = begin; i <= end;) {
    const bool high = lifted(pass, i, level);
    std::int64_t last = i;
    while (last < end && lifted(pass, last + 1, level) == high) ++last;
    if (last > i) {
      PassPart part{high ? level_part(pass, i, last, level) : chords(pass, i, last, level), high};
      if (!high || part.path.front().z() < previous - kNothing) parts.push_back(std::move(part));
    }
    i = last + 1;
  }
}

/// At the height of the highest node.
TipPath PassGrid::level_part(std::int64_t pass, std::int64_t begin, std::int64_t end,
                             double level) const {
  double z = level;
  for (std::int64_t i = begin; i <= end; ++i) z = std::max(z, node(pass, i));
  TipPath path;
  for (const std::int64_t i : {begin, end}) {
    const Eigen::Vector2d p = place(pass, static_cast<double>(i));
    path.emplace_back(p.x(), p.y(), z);
  }
  return path;
}

/// Greedy: every chord starts at the nodes' height or above, with the least slope that clears all
/// nodes passed, and runs as far as it stays within kChordShare of them.
TipPath PassGrid::chords(std::int64_t pass, std::int64_t begin, std::int64_t end,
                         double level) const {
  const double gate = kChordShare * spacing_;
  const auto height = [&](std::int64_t i) { return std::max(level, node(pass, i)); };
  TipPath path;
  const auto add = [&](std::int64_t i, double z) {
    const Eigen::Vector2d p = place(pass, static_cast<double>(i));
    path.emplace_back(p.x(), p.y(), z);
  };
  add(begin, height(begin));
  for (std::int64_t from = begin; from < end;) {
    const double z = path.back().z();
    double least = -HUGE_VAL;
    double most = HUGE_VAL;
    std::int64_t reached = from;
    for (std::int64_t to = from + 1; to <= end; ++to) {
      const double run = spacing_ * static_cast<double>(to - from);
      const double low = std::max(least, (height(to) - z) / run);
      most = std::min(most, (height(to) + gate - z) / run);
      if (low > most) break;
      least = low;
      reached = to;
    }
    const double run = spacing_ * static_cast<double>(reached - from);
    add(reached, std::max(height(reached), z + least * run));
    from = reached;
  }
  return path;
}

namespace {

/// Maximum slope of the floor on a helix's circle: lenses have no more. Over a rim or beside a
/// clamp, where it is steeper, another circle or a ramp is used.
constexpr double kSteepestHelix = 0.5;

/// The first part of a path, of given length seen from above, with the length up to each point.
struct Prefix {
  TipPath points;
  std::vector<double> lengths;
};

Prefix prefix_of(const TipPath& path, double length) {
  Prefix prefix{{path.front()}, {0.0}};
  for (std::size_t i = 1; i < path.size() && prefix.lengths.back() < length; ++i) {
    const double step = (path[i] - path[i - 1]).head<2>().norm();
    const double part = std::min(1.0, (length - prefix.lengths.back()) / step);
    prefix.points.emplace_back(path[i - 1] + part * (path[i] - path[i - 1]));
    prefix.lengths.push_back(prefix.lengths.back() + part * step);
  }
  return prefix;
}

double length_of(const TipPath& path) {
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).head<2>().norm();
  return length;
}

Eigen::Vector3d at_height(const Eigen::Vector3d& p, double z) { return {p.x(), p.y(), z}; }

double steepest_of(const TipPath& path) {
  double steepest = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector3d way = path[i] - path[i - 1];
    steepest = std::max(steepest, std::abs(way.z()) / way.head<2>().norm());
  }
  return steepest;
}

/// A closed circle around `centre` from `begin`, counter-clockwise, in at least twelve chords no
/// longer than `spacing`, at the height of `begin`.
TipPath circle_from(const Eigen::Vector3d& begin, const Eigen::Vector2d& centre, double spacing) {
  const Eigen::Vector2d arm = begin.head<2>() - centre;
  const double around = 2.0 * std::numbers::pi;
  const double count = std::max(12.0, std::ceil(around * arm.norm() / spacing));
  TipPath circle{begin};
  for (double i = 1.0; i < count; ++i) {
    const Eigen::Vector2d p = centre + Eigen::Rotation2Dd(around * i / count) * arm;
    circle.emplace_back(p.x(), p.y(), begin.z());
  }
  circle.push_back(begin);
  return circle;
}

}  // namespace

double highest_obstacle(const Workshop& workshop, const Eigen::AlignedBox3d& blank) {
  double top = blank.max().z();
  for (const KeepOut& box : workshop.keep_outs) top = std::max(top, box.high.z());
  return top;
}

double safe_height_of(const Workshop& workshop, const Eigen::AlignedBox3d& blank) {
  return highest_obstacle(workshop, blank) + workshop.process.safe_height;
}

RoughLinks::RoughLinks(const LinkSite& site, RoughMoves& moves)
    : site_(site), moves_(moves), parts_(whole_profile(site.tool)) {}

void RoughLinks::enter(const TipPath& path) {
  const Eigen::Vector3d& begin = path.front();
  travel(begin);
  const double air = site_.stock.drop(parts_.front(), begin.head<2>());
  const double lift = air - begin.z();
  if (lift > kThinMaterial && !helix(path)) ramp(path, lift);
  moves_.feed(MoveKind::kPlunge, begin);
}

/// Tries the circles ahead, where the pass goes anyway, to its left and right, and behind.
bool RoughLinks::helix(const TipPath& path) {
  if (!(site_.helix_radius > 0.0)) return false;
  const Eigen::Vector3d& begin = path.front();
  const Eigen::Vector2d ahead = site_.helix_radius * (path[1] - begin).head<2>().normalized();
  const Eigen::Vector2d left(-ahead.y(), ahead.x());
  for (const Eigen::Vector2d& way :
       {ahead, left, Eigen::Vector2d(-left), Eigen::Vector2d(-ahead)}) {
    TipPath circle = circle_from(begin, begin.head<2>() + way, site_.spacing);
    lift_to_floor(circle);
    if (steepest_of(circle) > kSteepestHelix) continue;
    wind_down(circle);
    const double rest = circle.front().z() - begin.z();
    if (rest > kThinMaterial) ramp(path, rest);
    return true;
  }
  return false;
}

/// Raises every point to the floor over the chords beside it, so that they are nowhere below it.
void RoughLinks::lift_to_floor(TipPath& circle) const {
  TipFloor::Trace trace;
  const double lowest = circle.front().z();
  double before = lowest;  // Of the last chord, which ends where the first begins.
  for (std::size_t i = 1; i < circle.size(); ++i) {
    const Eigen::Vector2d middle = 0.5 * (circle[i - 1] + circle[i]).head<2>();
    const double reach = 0.5 * (circle[i] - circle[i - 1]).head<2>().norm();
    const double floor = site_.floor.over(middle, reach, trace);
    circle[i - 1].z() = std::max({lowest, before, floor});
    before = floor;
  }
  circle.front().z() = std::max(circle.front().z(), before);
  circle.back() = circle.front();
}

/// Starts above all material on the circle, so that the tool meets it only from above.
void RoughLinks::wind_down(const TipPath& circle) {
  double lift = 0.0;
  for (const Eigen::Vector3d& p : circle) {
    lift = std::max(lift, site_.stock.drop(parts_.front(), p.head<2>()) - p.z());
  }
  const double steepest = std::tan(site_.ramp_angle_deg * std::numbers::pi / 180.0);
  const double turns = std::ceil(lift / (steepest * length_of(circle)) - 1e-9);
  const auto chords = static_cast<double>(circle.size() - 1);
  moves_.feed(MoveKind::kPlunge, at_height(circle.front(), circle.front().z() + lift));
  for (double turn = 0.0; turn < turns; ++turn) {
    for (std::size_t i = 1; i < circle.size(); ++i) {
      const double left = 1.0 - (turn + static_cast<double>(i) / chords) / turns;
      moves_.feed(MoveKind::kPlunge, at_height(circle[i], circle[i].z() + left * lift));
    }
  }
}

/// Goes to and fro along the first part of the path, as often as its length requires, descending
/// all the time.
void RoughLinks::ramp(const TipPath& path, double lift) {
  const double need = 0.5 * lift / std::tan(site_.ramp_angle_deg * std::numbers::pi / 180.0);
  const double leg = std::min(need, length_of(path));
  const double rounds = std::ceil(need / leg - 1e-9);
  const double sink = 0.5 * lift / rounds;  // A leg.
  const Prefix prefix = prefix_of(path, leg);
  const std::size_t last = prefix.points.size() - 1;
  const auto go = [&](std::size_t i, double above) {
    moves_.feed(MoveKind::kPlunge, at_height(prefix.points[i], prefix.points[i].z() + above));
  };
  double above = lift;
  go(0, above);
  for (double round = 0.0; round < rounds; ++round) {
    for (std::size_t i = 1; i <= last; ++i) go(i, above - sink * prefix.lengths[i] / leg);
    above -= sink;
    for (std::size_t i = last; i > 0; --i) {
      go(i - 1, above - sink * (1.0 - prefix.lengths[i - 1] / leg));
    }
    above -= sink;
  }
}

bool RoughLinks::cross(const Eigen::Vector3d& end, double level) {
  const Eigen::Vector3d begin = moves_.at();
  const double length = (end - begin).head<2>().norm();
  const auto steps =
      std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(length / site_.spacing)));
  TipFloor::Trace trace;
  std::vector<double> floors;
  for (std::int64_t i = 0; i < steps; ++i) {
    const double part = (static_cast<double>(i) + 0.5) / static_cast<double>(steps);
    const Eigen::Vector2d p = (begin + part * (end - begin)).head<2>();
    const double reach = 0.5 * length / static_cast<double>(steps);
    floors.push_back(site_.floor.over_surface(p, reach, trace));
    if (floors.back() >= site_.stock.blank().max().z()) return false;
    if (site_.floor.over_clamps(p, reach) > std::max(level, floors.back())) return false;
  }
  if (std::max(level, floors.back()) > end.z() + kThinMaterial) return false;
  for (std::int64_t i = 0; i <= steps; ++i) {
    double z = i == steps ? std::max(level, end.z()) : level;
    if (i > 0) z = std::max(z, floors[static_cast<std::size_t>(i - 1)]);
    if (i < steps) z = std::max(z, floors[static_cast<std::size_t>(i)]);
    const double part = static_cast<double>(i) / static_cast<double>(steps);
    if (i > 0 || z > begin.z()) {
      moves_.feed(MoveKind::kCut, at_height(begin + part * (end - begin), z));
    }
  }
  if (moves_.at().z() > end.z()) moves_.feed(MoveKind::kCut, end);
  return true;
}

void RoughLinks::retract() {
  if (moves_.placed()) moves_.rapid(at_height(moves_.at(), site_.safe_z));
}

/// Height of the tip above which nothing of the tool touches material over p.
double RoughLinks::air_above(const Eigen::Vector2d& p) {
  double height = kNoContact;
  for (const CutterProfile& part : parts_) {
    height = std::max(height, site_.stock.drop(widened(part, 0.5 * site_.spacing), p));
  }
  return height;
}

/// A height at which the whole tool can go straight to `to` above all material and clear of clamps;
/// nothing if that is not below the safe height, or slower.
std::optional<double> RoughLinks::clear_height(const Eigen::Vector3d& to) {
  const Eigen::Vector3d& from = moves_.at();
  const Eigen::Vector3d& rate = site_.workshop.machine.max_rate;
  const double length = (to - from).head<2>().norm();
  const double rapid =
      length / rate.head<2>().minCoeff() + (2.0 * site_.safe_z - from.z() - to.z()) / rate.z();
  if (length / site_.tool.feed > rapid) return std::nullopt;
  const auto steps =
      std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(length / site_.spacing)));
  double height = std::max(from.z(), to.z());
  TipFloor::Trace trace;
  for (std::int64_t i = 0; i <= steps; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(steps);
    const Eigen::Vector2d p = (from + part * (to - from)).head<2>();
    height = std::max({height, air_above(p), site_.floor.over(p, 0.5 * site_.spacing, trace)});
  }
  const double climb = 2.0 * height - from.z() - to.z();
  if ((length + climb) / site_.tool.feed > rapid) return std::nullopt;
  return height;
}

/// Moves to a place above `to` from which the tool is fed down through air, or to the material
/// there.
void RoughLinks::travel(const Eigen::Vector3d& to) {
  const std::optional<double> height = moves_.placed() ? clear_height(to) : std::nullopt;
  if (height) {
    moves_.feed(MoveKind::kLink, at_height(moves_.at(), *height));
    moves_.feed(MoveKind::kLink, at_height(to, *height));
    return;
  }
  retract();
  moves_.rapid(at_height(to, site_.safe_z));
  const double clear = std::max(to.z(), air_above(to.head<2>())) + site_.workshop.process.clearance;
  if (clear < site_.safe_z) moves_.rapid(at_height(to, clear));
}

namespace {

/// Cells of the stock map: a quarter of the smallest default ball's diameter. On slopes of 0.3 the
/// map overstates the material by 0.03 mm.
constexpr double kStockCell = 0.1;
constexpr double kMaxCells = 2000.0;  ///< Along the blank's longer side.

/// One raster, on one level or many.
struct Raster {
  std::string name;
  const Tool& tool;
  double stepover;
  double allowance;
  double ramp_angle_deg;
  double helix_radius;  ///< mm; 0 for ramps.
  double spacing;
  PassStyle style;
  PassAxis along;
};

template <class Following>
Raster raster_of(const char* name, const Workshop& workshop, const Following& process) {
  return {name,
          workshop.tool(process.tool),
          process.stepover,
          process.allowance,
          process.ramp_angle_deg,
          process.entry == EntryStyle::kHelix ? process.helix_radius : 0.0,
          process.spacing,
          process.style,
          process.along};
}

Eigen::AlignedBox2d from_above(const Eigen::AlignedBox3d& box) {
  return {box.min().head<2>(), box.max().head<2>()};
}

Eigen::AlignedBox2d grown_by(const Eigen::AlignedBox2d& box, double beyond) {
  const Eigen::Vector2d all(beyond, beyond);
  return {box.min() - all, box.max() + all};
}

/// Distance beyond the lens of later tools' axes: the finishing ball turns a full radius outside
/// and needs clear material there, so the semi-finishing tool goes twice as far.
double axis_beyond(const Workshop& workshop) {
  return 2.0 * workshop.tool(workshop.process.finish.tool).radius();
}

/// Width beside the lens that must be cleared to the rim's height before later tools come, mm.
double cleared_width(const Workshop& workshop, const Eigen::AlignedBox3d& surface, double top) {
  const Tool& ball = workshop.tool(workshop.process.finish.tool);
  const double depth = top - surface.min().z() + ball.radius();
  double width = axis_beyond(workshop) + widest_below(ball, depth);
  if (workshop.process.semi.enabled) {
    const Tool& semi = workshop.tool(workshop.process.semi.tool);
    width = std::max(width, axis_beyond(workshop) + widest_below(semi, depth));
  }
  return width + workshop.process.clearance;
}

/// Rectangle of the axis: `beyond` around the lens, or out of the blank on sides where less than
/// the tool's radius would be left standing.
Eigen::AlignedBox2d axis_area(const RoughSite& site, double radius, double beyond) {
  const Eigen::AlignedBox2d lens = from_above(site.surface.bounds());
  const Eigen::AlignedBox2d blank = from_above(site.stock.blank());
  const auto side = [&](double margin) {
    return beyond + radius >= margin - radius ? margin + radius : beyond;
  };
  Eigen::AlignedBox2d area = lens;
  for (int axis = 0; axis < 2; ++axis) {
    area.min()[axis] -= side(lens.min()[axis] - blank.min()[axis]);
    area.max()[axis] += side(blank.max()[axis] - lens.max()[axis]);
  }
  return area;
}

/// Heights of equal steps from `top`, excluded, to `lowest`, included.
std::vector<double> level_heights(double top, double lowest, double stepdown) {
  const double count = std::max(1.0, std::ceil((top - lowest) / stepdown - 1e-9));
  std::vector<double> levels;
  for (double level = 1.0; level <= count; ++level) {
    levels.push_back(top - (top - lowest) * level / count);
  }
  return levels;
}

/// With a clockwise spindle a tool climbs where the uncut side, here that of the later passes, is
/// on the right of its travel: towards −x with passes along x, towards +y along y.
bool starts_backwards(const Raster& raster) {
  const bool climb_is_back = raster.along == PassAxis::kX;
  if (raster.style == PassStyle::kClimb) return climb_is_back;
  return raster.style == PassStyle::kConventional && !climb_is_back;
}

/// One run over all levels and passes.
class RasterRun {
 public:
  RasterRun(const RoughSite& site, const Raster& raster, const PassGrid& grid,
            const TipFloor& floor, RoughMoves& moves)
      : raster_(raster),
        grid_(grid),
        moves_(moves),
        links_({site.workshop, raster.tool, floor, site.stock,
                safe_height_of(site.workshop, site.stock.blank()), raster.ramp_angle_deg,
                raster.helix_radius, raster.spacing},
               moves),
        backwards_(starts_backwards(raster)) {}

  /// @return the number of parts of passes cut.
  std::int64_t level(double height, double previous, const RunControl& control) {
    std::int64_t cut = 0;
    for (std::int64_t pass = 0; pass < grid_.passes(); ++pass) {
      if (control.stop_requested()) throw Interrupted();
      std::vector<PassPart> parts = grid_.parts(pass, height, previous);
      if (parts.empty()) continue;
      if (backwards_) turn(parts);
      for (const PassPart& part : parts) follow(part, height);
      cut += static_cast<std::int64_t>(parts.size());
      if (raster_.style == PassStyle::kZigzag) backwards_ = !backwards_;
      control.report({"cam " + raster_.name, static_cast<double>(pass + 1),
                      static_cast<double>(grid_.passes()), "down to z " + decimal_text(height, 2)});
    }
    links_.retract();
    cutting_ = false;
    return cut;
  }

 private:
  static void turn(std::vector<PassPart>& parts) {
    std::reverse(parts.begin(), parts.end());
    for (PassPart& part : parts) std::reverse(part.path.begin(), part.path.end());
  }

  void follow(const PassPart& part, double height) {
    const TipPath& path = part.path;
    const double near = 1.5 * grid_.stepover() + 2.0 * raster_.spacing;
    const bool beside = moves_.placed() && raster_.style == PassStyle::kZigzag &&
                        (path.front() - moves_.at()).head<2>().norm() <= near;
    if (!beside || !cutting_ || !links_.cross(path.front(), height)) links_.enter(path);
    for (std::size_t i = 1; i < path.size(); ++i) moves_.feed(MoveKind::kCut, path[i]);
    // A tool lifted by a clamp must not come down at the cutting feed.
    cutting_ = !part.lifted;
  }

  const Raster& raster_;
  const PassGrid& grid_;
  RoughMoves& moves_;
  RoughLinks links_;
  bool backwards_;
  bool cutting_ = false;  ///< The tool is at the end of a pass that no clamp has lifted.
};

void warn_of_clamps(const RoughSite& site, const Raster& raster, OperationSummary& summary) {
  const Eigen::AlignedBox2d lens = from_above(site.surface.bounds());
  for (const KeepOut& box : site.workshop.keep_outs) {
    const double away = raster.tool.radius() + site.workshop.process.clearance;
    const Eigen::AlignedBox2d taken =
        grown_by({box.low.head<2>(), box.high.head<2>()}, away).intersection(lens);
    if (taken.isEmpty()) continue;
    summary.warnings.push_back(
        "the keep-out box '" + box.name + "' keeps tool " + std::to_string(raster.tool.number) +
        " from the lens at x " + decimal_text(taken.min().x(), 1) + " to " +
        decimal_text(taken.max().x(), 1) + " y " + decimal_text(taken.min().y(), 1) + " to " +
        decimal_text(taken.max().y(), 1) + ": that part stays uncut");
  }
}

void warn_of_flutes(const Tool& tool, const Extreme& deepest, OperationSummary& summary) {
  if (deepest.value <= tool.flute_length) return;
  summary.warnings.push_back(
      "tool " + std::to_string(tool.number) + " cuts " + decimal_text(deepest.value, 2) +
      " mm deep at x " + decimal_text(deepest.place.x(), 1) + " y " +
      decimal_text(deepest.place.y(), 1) + ", its flutes are " +
      decimal_text(tool.flute_length, 2) + " mm long: use smaller steps down or a longer tool");
}

/// Further inputs of a run.
struct RunPlan {
  double beyond;    ///< Of the axis, around the lens, mm.
  double stepdown;  ///< 0: one level that follows the surface.
};

RoughResult cut(const RoughSite& site, const Raster& raster, const RunPlan& plan,
                const Executor& executor, const MoveSink& sink, const RunControl& control) {
  const Workshop& workshop = site.workshop;
  const TipFloor floor(site.surface, raster.tool, raster.allowance, workshop.keep_outs,
                       workshop.process.clearance);
  const double radius = raster.tool.radius();
  const PassGrid grid(floor,
                      {axis_area(site, radius, std::max(plan.beyond, floor.hold())),
                       grown_by(from_above(site.stock.blank()), radius), raster.along,
                       raster.stepover, raster.spacing},
                      executor, control);
  RoughResult result;
  OperationSummary& summary = result.summary;
  summary.name = raster.name;
  summary.tool = raster.tool.number;
  summary.stepover = grid.stepover();
  summary.allowance = raster.allowance;
  RoughMoves moves(raster.tool, site.stock, sink, summary);
  RasterRun run(site, raster, grid, floor, moves);
  double previous = site.stock.blank().max().z();
  const double lowest = std::min(grid.lowest(), previous);
  const std::vector<double> levels =
      level_heights(previous, lowest, plan.stepdown > 0.0 ? plan.stepdown : HUGE_VAL);
  if (plan.stepdown > 0.0)
    summary.stepdown = (previous - lowest) / static_cast<double>(levels.size());
  for (const double level : levels) {
    summary.passes += run.level(level, previous, control);
    previous = level;
  }
  moves.flush();
  summary.certificate.excess = grid.excess();
  summary.certified = true;
  summary.complete = true;
  result.deepest_cut = moves.deepest_cut();
  result.most_left = most_left(site.stock, site.surface, executor);
  warn_of_clamps(site, raster, summary);
  warn_of_flutes(raster.tool, result.deepest_cut, summary);
  return result;
}

}  // namespace

StockMap whole_blank(const Workshop& workshop, const Eigen::AlignedBox3d& surface) {
  const Eigen::AlignedBox3d blank = workshop.stock.box(surface);
  const double longest = blank.sizes().head<2>().maxCoeff();
  return {blank, std::max(kStockCell, longest / kMaxCells)};
}

double rough_reach(const Workshop& workshop, const Eigen::AlignedBox3d& surface, double top) {
  const auto reach = [&](const auto& process, double beyond) {
    if (!process.enabled) return 0.0;
    const Tool& tool = workshop.tool(process.tool);
    return std::max(beyond, TipFloor::hold_of(tool, process.allowance)) + tool.radius();
  };
  const Process& process = workshop.process;
  const double rough_radius = workshop.tool(process.rough.tool).radius();
  return std::max(reach(process.rough, cleared_width(workshop, surface, top) - rough_radius),
                  reach(process.semi, axis_beyond(workshop)));
}

RoughResult cut_rough(const RoughSite& site, const Executor& executor, const MoveSink& sink,
                      const RunControl& control) {
  const RoughProcess& process = site.workshop.process.rough;
  const Raster raster = raster_of("rough", site.workshop, process);
  const double width =
      cleared_width(site.workshop, site.surface.bounds(), site.stock.blank().max().z());
  const RunPlan plan{width - raster.tool.radius(), process.stepdown};
  return cut(site, raster, plan, executor, sink, control);
}

RoughResult cut_semi(const RoughSite& site, const Executor& executor, const MoveSink& sink,
                     const RunControl& control) {
  const Raster raster = raster_of("semi", site.workshop, site.workshop.process.semi);
  return cut(site, raster, {axis_beyond(site.workshop), 0.0}, executor, sink, control);
}

}  // namespace lensforge
