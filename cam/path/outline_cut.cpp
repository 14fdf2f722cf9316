// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/outline_cut.h"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>

#include "cam/path/rough.h"
#include "cam/workshop/tool.h"
#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

namespace bg = boost::geometry;
using Point = bg::model::d2::point_xy<double>;
using Polygon = bg::model::polygon<Point, false>;
using Polygons = bg::model::multi_polygon<Polygon>;

/// Chords of a full circle around a corner.
constexpr int kChords = 720;

/// Corners closer than this to the line between their neighbours are dropped, mm.
constexpr double kSimplify = 0.002;

Polygons grown(const Polygon& polygon, double distance) {
  const bg::strategy::buffer::distance_symmetric<double> by(distance);
  const bg::strategy::buffer::join_round round(kChords);
  Polygons result;
  bg::buffer(polygon, result, by, bg::strategy::buffer::side_straight(), round,
             bg::strategy::buffer::end_round(kChords), bg::strategy::buffer::point_circle(kChords));
  return result;
}

/// The largest part without its holes, which no tool reaches from outside.
Polygon outer(const Polygons& polygons) {
  const auto largest = std::max_element(
      polygons.begin(), polygons.end(),
      [](const Polygon& a, const Polygon& b) { return bg::area(a) < bg::area(b); });
  LF_CHECK(largest != polygons.end(), "no polygon");
  Polygon result;
  result.outer() = largest->outer();
  return result;
}

}  // namespace

OutlineWay offset_outline(const std::vector<Eigen::Vector2d>& polygon, double radius) {
  Polygon part;
  for (const Eigen::Vector2d& p : polygon) bg::append(part.outer(), Point(p.x(), p.y()));
  bg::correct(part);
  // Chords lie inside of the circle around a corner; simplifying moves the path by at most
  // kSimplify.
  const double chord = std::cos(std::numbers::pi / kChords);
  const Polygon way = outer(grown(part, (radius + 0.5 * kOutlineOversize) / chord));
  Polygon simple;
  bg::simplify(way, simple, kSimplify);
  OutlineWay result;
  for (std::size_t k = 0; k + 1 < simple.outer().size(); ++k) {
    result.points.emplace_back(simple.outer()[k].x(), simple.outer()[k].y());
  }
  const double filled = bg::area(grown(way, -radius));
  const double rim = kOutlineOversize * static_cast<double>(bg::perimeter(part));
  result.left = std::max(0.0, filled - bg::area(part) - rim);
  return result;
}

namespace {

constexpr double kRadPerDegree = std::numbers::pi / 180.0;
constexpr double kNever = -std::numeric_limits<double>::infinity();

/// Starting points tried for the tabs, in one interval between tabs.
constexpr int kStarts = 32;

/// Minimum area of a notch left uncut that is reported, mm².
constexpr double kWorthTelling = 0.05;

/// A closed path, parametrised by length from its first point.
class Loop {
 public:
  explicit Loop(std::vector<Eigen::Vector2d> points) : points_(std::move(points)) {
    at_.push_back(0.0);
    for (std::size_t k = 0; k < points_.size(); ++k) {
      at_.push_back(at_.back() + (point(k + 1) - point(k)).norm());
    }
  }

  [[nodiscard]] double length() const { return at_.back(); }
  /// Lengths of the corners, 0 … length().
  [[nodiscard]] const std::vector<double>& corners() const { return at_; }
  /// A length reduced to the first turn.
  [[nodiscard]] double wrapped(double s) const { return s - length() * std::floor(s / length()); }
  [[nodiscard]] Eigen::Vector2d place(double s) const {
    const double on = wrapped(s);
    const auto next = std::upper_bound(at_.begin() + 1, at_.end() - 1, on);
    const auto k = static_cast<std::size_t>(next - at_.begin()) - 1;
    return point(k) + (on - at_[k]) / (at_[k + 1] - at_[k]) * (point(k + 1) - point(k));
  }

 private:
  [[nodiscard]] const Eigen::Vector2d& point(std::size_t k) const {
    return points_[k % points_.size()];
  }

  std::vector<Eigen::Vector2d> points_;
  std::vector<double> at_;
};

double ramp_slope(const OutlineCut& cut) { return std::tan(cut.ramp_angle_deg * kRadPerDegree); }

/// Heights of the tool over the tabs and on the ramps behind them.
class Tabs {
 public:
  Tabs(const Loop& loop, const OutlineCut& cut, const Eigen::AlignedBox3d& blank)
      : loop_(loop), cut_(cut), half_(0.5 * cut.tabs.width + cut.tool.radius()) {
    if (cut.tabs.count == 0) return;
    const double apart = loop.length() / cut.tabs.count;
    double start = 0.0;
    for (int k = 0; k < kStarts; ++k) {
      const double frame = frame_at(k * apart / kStarts, apart, blank);
      if (frame <= frame_) continue;
      frame_ = frame;
      start = k * apart / kStarts;
    }
    for (int k = 0; k < cut.tabs.count; ++k) middles_.push_back(start + k * apart);
  }

  /// Of the tab with the least, mm.
  [[nodiscard]] double frame() const { return frame_; }
  [[nodiscard]] double ramp_length() const { return cut_.tabs.height / ramp_slope(cut_); }

  /// Minimum height of the tip at a place of the path, mm. @param sense  of the turn, 1 or −1.
  [[nodiscard]] double floor(double s, double sense) const {
    double floor = kNever;
    for (const double middle : middles_) {
      double past = loop_.wrapped(sense * (s - middle) + half_);
      // A place on the edge belongs to the tab, however it was rounded.
      if (past > loop_.length() - kEdge) past = 0.0;
      const double behind = past - 2.0 * half_;
      floor = std::max(floor, cut_.tabs.height - ramp_slope(cut_) * std::max(0.0, behind));
    }
    return floor;
  }

  /// Places where floor() has a corner, on the first turn.
  [[nodiscard]] std::vector<double> edges(double sense) const {
    std::vector<double> edges;
    for (const double middle : middles_) {
      const double enter = middle - sense * half_;
      const double leave = middle + sense * half_;
      for (const double s : {enter - sense * kStep, enter, leave, leave + sense * ramp_length()}) {
        edges.push_back(loop_.wrapped(s));
      }
    }
    return edges;
  }

 private:
  static constexpr double kEdge = 1e-7;  ///< mm
  static constexpr double kStep = 1e-3;  ///< Step over which the tool is lifted before a tab, mm.

  /// Distance between the slot and the blank's edge, at the tab with the least.
  [[nodiscard]] double frame_at(double start, double apart,
                                const Eigen::AlignedBox3d& blank) const {
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < cut_.tabs.count; ++k) {
      for (const double beside : {-half_, 0.0, half_}) {
        const Eigen::Vector2d p = loop_.place(start + k * apart + beside);
        const Eigen::Vector2d low = p - blank.min().head<2>();
        const Eigen::Vector2d high = blank.max().head<2>() - p;
        least = std::min({least, low.minCoeff(), high.minCoeff()});
      }
    }
    return least - cut_.tool.radius();
  }

  const Loop& loop_;
  const OutlineCut& cut_;
  double half_;
  double frame_ = kNever;
  std::vector<double> middles_;
};

/// Length of the path for one tab and for ramping to the underside on both sides of it, mm.
double room_for_tab(const OutlineCut& cut) {
  return cut.tabs.width + cut.tool.diameter + 2.0 * cut.tabs.height / ramp_slope(cut);
}

/// Runs the turns.
class OutlineRun {
 public:
  OutlineRun(const Loop& loop, const Tabs& tabs, RoughMoves& moves)
      : loop_(loop), tabs_(tabs), moves_(moves) {}

  /// One turn from height `from` to `to`, starting and ending at the path's first point. @param
  /// sense  1 or −1.
  void turn(double from, double to, double sense) {
    std::vector<double> stops = stops_of(sense);
    if (sense < 0.0) std::reverse(stops.begin(), stops.end());
    const double start = stops.front();
    for (std::size_t k = 1; k < stops.size(); ++k) {
      if (stops[k] == stops[k - 1]) continue;
      const double share = std::abs(stops[k] - start) / loop_.length();
      cut_to(stops[k], std::max(from + share * (to - from), tabs_.floor(stops[k], sense)));
    }
  }

  /// Ends at the path's first point at the bottom. The tool may still be behind a tab: it follows
  /// the ramp to its end, and returns.
  void settle(double bottom) {
    const std::vector<double> stops = stops_of(1.0);
    std::size_t k = 0;
    for (; k + 1 < stops.size() && tabs_.floor(stops[k], 1.0) > bottom + kLevel; ++k) {
      cut_to(stops[k + 1], std::max(bottom, tabs_.floor(stops[k + 1], 1.0)));
    }
    while (k > 0) cut_to(stops[--k], bottom);
  }

 private:
  static constexpr double kLevel = 1e-6;  ///< Of heights that are equal except for rounding, mm.

  /// All places where the height may change, on the first turn.
  [[nodiscard]] std::vector<double> stops_of(double sense) const {
    std::vector<double> stops = loop_.corners();
    for (const double edge : tabs_.edges(sense)) stops.push_back(edge);
    std::sort(stops.begin(), stops.end());
    return stops;
  }

  void cut_to(double s, double z) {
    const Eigen::Vector2d p = loop_.place(s);
    moves_.feed(MoveKind::kCut, {p.x(), p.y(), z});
  }

  const Loop& loop_;
  const Tabs& tabs_;
  RoughMoves& moves_;
};

/// Minimum height of the tip at which it touches nothing anywhere on the path.
double top_of_material(const Loop& loop, const Tool& tool, StockMap& stock) {
  double top = stock.blank().min().z();
  const CutterProfile profile = cutting_profile(tool);
  for (const double s : loop.corners()) top = std::max(top, stock.drop(profile, loop.place(s)));
  return top;
}

}  // namespace

OutlineCut with_tabs_that_fit(const std::vector<Eigen::Vector2d>& outline, OutlineCut cut) {
  const Loop loop(offset_outline(outline, cut.tool.radius()).points);
  const int most = static_cast<int>(loop.length() / room_for_tab(cut));
  cut.tabs.count = std::min(cut.tabs.count, std::max(1, most));
  return cut;
}

void require_outline_cut(const std::vector<Eigen::Vector2d>& outline, const OutlineCut& cut,
                         const Eigen::AlignedBox3d& blank) {
  if (cut.tool.shape != CutterShape::kFlat) {
    throw InputError("--outline-tool " + std::to_string(cut.tool.number) +
                     ": must be a flat end mill, which leaves straight walls");
  }
  if (cut.tabs.count == 0) return;
  const Loop loop(offset_outline(outline, cut.tool.radius()).points);
  const Tabs tabs(loop, cut, blank);
  if (loop.length() < room_for_tab(cut) * cut.tabs.count) {
    throw InputError("--tabs " + std::to_string(cut.tabs.count) + ": need " +
                     number_text(room_for_tab(cut), 3) +
                     " mm each, for the tool to get down between them along its ramp of " +
                     number_text(cut.ramp_angle_deg) + " degrees, and the way around has " +
                     number_text(loop.length(), 3) + " mm; a lower --tab-height or --tabs 0 works");
  }
  if (tabs.frame() < kTabFrame) {
    throw InputError(
        "--margin: a tab has " + number_text(std::max(0.0, tabs.frame()), 3) +
        " mm of the blank outside of the slot of tool " + std::to_string(cut.tool.number) +
        ": must have at least " + number_text(kTabFrame) + " mm; --margin " +
        number_text(std::ceil(cut.tool.diameter + kTabFrame + 0.1)) + "mm works, or --tabs 0");
  }
}

OperationSummary cut_outline(const std::vector<Eigen::Vector2d>& outline, const OutlineCut& cut,
                             StockMap& stock, const MoveSink& sink, const RunControl& control) {
  const OutlineWay way = offset_outline(outline, cut.tool.radius());
  const Loop loop(way.points);
  const Tabs tabs(loop, cut, stock.blank());
  OperationSummary summary;
  summary.name = "outline";
  summary.tool = cut.tool.number;
  RoughMoves moves(cut.tool, stock, sink, summary);
  OutlineRun run(loop, tabs, moves);
  const double bottom = cut.bottom;
  double z = std::max(top_of_material(loop, cut.tool, stock), bottom);
  const double step = std::min(cut.stepdown, ramp_slope(cut) * loop.length());
  const int turns = std::max(1, static_cast<int>(std::ceil((z - bottom) / step)));
  const Eigen::Vector2d start = loop.place(0.0);
  moves.rapid({start.x(), start.y(), cut.safe_z});
  moves.rapid({start.x(), start.y(), std::min(cut.safe_z, z + cut.clearance)});
  moves.feed(MoveKind::kPlunge, {start.x(), start.y(), std::max(z, tabs.floor(0.0, 1.0))});
  const double top = z;
  for (int k = 1; k <= turns; ++k) {
    if (control.stop_requested()) throw Interrupted();
    const double next = top + (bottom - top) * k / turns;
    run.turn(z, next, 1.0);
    z = next;
  }
  run.turn(bottom, bottom, 1.0);
  run.settle(bottom);
  run.turn(bottom, bottom, -1.0);
  moves.rapid({start.x(), start.y(), cut.safe_z});
  moves.flush();
  summary.passes = turns + 2;
  summary.stepdown = (top - bottom) / turns;
  summary.complete = true;
  if (way.left > kWorthTelling) {
    summary.warnings.push_back("tool " + std::to_string(cut.tool.number) +
                               " is too wide for notches of the outline: " +
                               number_text(way.left, 3) + " mm2 of the blank stay in them");
  }
  if (moves.deepest_cut().value > cut.tool.flute_length) {
    summary.warnings.push_back("the outline is cut deeper than the flutes of tool " +
                               std::to_string(cut.tool.number));
  }
  return summary;
}

}  // namespace lensforge
