// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/rough_links.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace lensforge {
namespace {

/// Material no thicker than this is entered without a ramp: what a cell of the stock map, which is
/// an upper bound, may show where there is none, mm.
constexpr double kThinMaterial = 0.01;

/// Rise over run of the floor on a helix' circle at most: lenses have no more. Over a rim or beside
/// a clamp, where there is more, another circle or a ramp is taken.
constexpr double kSteepestHelix = 0.5;

/// A path cut off after some length seen from above, with that length up to each point.
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

/// A closed circle around `centre` from `begin` on, counter-clockwise, in chords no longer than
/// `spacing` and no fewer than twelve, at the height of `begin`.
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

/// Tried are the circles ahead, where the pass goes anyway, to its left and right, and behind.
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

/// Every point as high as the floor over the chords beside it, so that none of them is below it
/// anywhere on its length.
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

/// From above all material on the circle, so that it is met from above only.
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

/// Forth and back along the first of the path, as often as its length asks for, sinking all the
/// way.
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

/// A height at which the whole tool goes straight to `to` above all material and clear of clamps;
/// nothing if that is no lower than the safe height, or slower.
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

/// To a place above `to` from which the tool is fed down through air, or to the material there.
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

}  // namespace lensforge
