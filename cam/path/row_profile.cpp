// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/row_profile.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "cam/contact/drop_curve.h"
#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Minimum step on arcs, mm; too coarse only next to a vertical wall.
constexpr double kFinestStep = 1e-9;

/// Arcs whose slope changes by less than this count as parabolas.
constexpr double kParabolaTurn = 0.1;

/// Error of a polyline as a share of that of chords between joints: a certificate then adds 4 times
/// as much, a tenth of the tolerances.
constexpr double kBowShare = 0.125;

/// Gaps up to this length, mm, are due to rounding.
constexpr double kGap = 1e-8;

/// Length of the stretches that a ball rolls along at once, and the minimum at which it gives up,
/// in radii: curvature bounds are coarser over longer ones.
constexpr double kStretch = 0.125;
constexpr double kMinStretch = 0.005;

/// Maximum distance of nodes of a lifted ball, mm; the lift is computed at each.
constexpr double kLiftNodes = 0.02;

/// To clear a gap, a ball rises this many times as steeply as its drop curve can.
constexpr double kRoof = 1.1;

/// Length over which that slope is bounded, mm.
constexpr double kRoofRun = 1.0;

/// Minimum height of a ball above anything that could hold it in a gap, and minimum length of its
/// path there, mm.
constexpr double kClear = 0.01;

/// Maximum distance of contact and axis, in radii: beyond it a ball rests only on slopes above 4.9,
/// steeper than any finished surface (RasterOptions::rim_slope).
constexpr double kFarthestRest = 0.98;

/// Length of the stretches whose facets are made at once, mm.
constexpr double kFacetStretch = 1.0;

/// Contacts this close to the rim count as on it, in radii: moves that take the ball over the rim
/// need room, and shorter ones than the controller takes in time are merged there.
constexpr double kOnRim = 0.1;

/// Places this close before the end of a stretch, in stretches, belong to the next: rounding.
constexpr double kSameStretch = 1e-6;

[[noreturn]] void throw_nothing_under(const AxisLine& line, double u) {
  const Eigen::Vector2d p = line.at(u);
  throw InputError("surface: nothing under the tool at x " + decimal_text(p.x(), 3) + " y " +
                   decimal_text(p.y(), 3) + " mm; it must cover the whole lens");
}

void add_node(double u, double z, RowProfile& profile) {
  profile.u.push_back(u);
  profile.z.push_back(z);
}

/// Appends the nodes after `from` up to `to` that keep the polyline within its error.
void follow(const CurvePiece& piece, double from, double to, RowProfile& profile) {
  const double off = bulge(piece, from, to);
  if (off > profile.finest && to - from > kFinestStep) {
    const double middle = 0.5 * (from + to);
    follow(piece, from, middle, profile);
    follow(piece, middle, to, profile);
    return;
  }
  profile.error = std::max(profile.error, off);
  add_node(to, piece.value(to), profile);
}

/// Appends joints after `from` up to `to`. A parabola rises over a chord by half the rise of its
/// end tangents, proportional to the square of the chord's width; steep arcs are no parabolas and
/// are halved first.
void add_joints(const CurvePiece& piece, double from, double to, double bow, RowProfile& profile) {
  const double off = 0.5 * bulge(piece, from, to);
  const double turn = std::abs(piece.slope(to) - piece.slope(from));
  if (off > bow && turn > kParabolaTurn) {
    const double middle = 0.5 * (from + to);
    add_joints(piece, from, middle, bow, profile);
    add_joints(piece, middle, to, bow, profile);
    return;
  }
  const double steps = std::ceil(std::sqrt(off / bow));
  for (double i = 1.0; i < steps; i += 1.0) {
    profile.joints.push_back(from + (to - from) * (i / steps));
  }
  profile.joints.push_back(to);
}

void require_cover(const std::vector<CurvePiece>& curve, const AxisLine& line, double from,
                   double to) {
  double covered = from;
  for (const CurvePiece& piece : curve) {
    if (piece.begin - covered > kGap) break;
    covered = piece.end;
  }
  if (to - covered > kGap) throw_nothing_under(line, covered);
}

/// Appends the drop curve of facets between held_from and held_to.
void add_facets(const DropCutter& cutter, const RowSpan& span, double bow,
                const std::stop_token& stop, RowProfile& profile) {
  const std::vector<CurvePiece> curve = drop_curve(cutter, span.line, span.held_from, span.held_to);
  require_cover(curve, span.line, span.held_from, span.held_to);
  profile.u.reserve(profile.u.size() + 4 * curve.size());
  profile.z.reserve(profile.z.size() + 4 * curve.size());
  for (const CurvePiece& piece : curve) {
    if (stop.stop_requested()) throw Interrupted();
    // A wall may end in a jump.
    add_node(piece.begin, piece.value(piece.begin), profile);
    follow(piece, piece.begin, piece.end, profile);
    add_joints(piece, piece.begin, piece.end, bow, profile);
  }
}

/// Appends the nodes of a smooth stretch, with joints at regular intervals.
void add_nodes(const CurveNodes& nodes, double bow, bool lifted, RowProfile& profile) {
  const std::size_t last = nodes.u.size() - 1;
  // A lift may turn at every node.
  const double skip =
      lifted ? 1.0 : std::max(1.0, std::floor(std::sqrt(bow / std::max(nodes.error, 1e-300))));
  const double parts = std::ceil(static_cast<double>(last) / skip);
  const auto stride = static_cast<std::size_t>(std::ceil(static_cast<double>(last) / parts));
  const bool repeats = profile.u.back() == nodes.u.front() && profile.z.back() == nodes.z.front();
  for (std::size_t i = repeats ? 1 : 0; i <= last; ++i) {
    add_node(nodes.u[i], nodes.z[i], profile);
    if (i > 0 && (i % stride == 0 || i == last)) profile.joints.push_back(nodes.u[i]);
  }
  profile.error = std::max(profile.error, nodes.error);
}

/// Maximum slope of the drop curve over a part of a row: that of the ball at its contact, whose
/// distance from the axis is at most that of the axis outside the rim plus that of the contact from
/// there.
double steepest_drop(const SmoothBed& bed, const Eigen::AlignedBox2d& axis) {
  const Eigen::AlignedBox2d& box = bed.surface().box();
  const double outside =
      std::max(box.exteriorDistance(axis.min()), box.exteriorDistance(axis.max()));
  const double out = std::min((outside + bed.reach(axis)) / bed.radius(), kFarthestRest);
  return out / std::sqrt(1.0 - out * out);
}

void extend_shaped(double place, RowProfile& profile) {
  profile.shaped_from = std::min(profile.shaped_from, place);
  profile.shaped_to = std::max(profile.shaped_to, place);
}

/// The part of a bed within its rim.
Eigen::AlignedBox2d off_rim(const SmoothBed& bed) {
  const Eigen::Vector2d rim = Eigen::Vector2d::Constant(kOnRim * bed.radius());
  const Eigen::AlignedBox2d& box = bed.surface().box();
  return {box.min() + rim, box.max() - rim};
}

/// Extends the shaped range by the places where the ball touches the surface within its rim.
void extend_shaped(const CurveNodes& nodes, const Eigen::AlignedBox2d& inside,
                   RowProfile& profile) {
  for (std::size_t i = 0; i < nodes.u.size(); ++i) {
    if (inside.contains(nodes.contact[i])) extend_shaped(nodes.u[i], profile);
  }
}

/// Length of a line from the end of a gap at `u` towards `far`, `rise` mm high, that keeps the drop
/// curve below it: the bound is tighter over a short line, if that is long enough.
double run_of(const SmoothBed& bed, const AxisLine& line, double u, double far, double rise) {
  const double end = u + std::clamp(far - u, -kRoofRun, kRoofRun);
  const auto run_to = [&](double to) {
    Eigen::AlignedBox2d axis(line.at(u));
    axis.extend(line.at(to));
    return rise / (kRoof * steepest_drop(bed, axis));
  };
  const double run = run_to(end);
  return run <= std::abs(end - u) ? run : run_to(far);
}

}  // namespace

double RowProfile::at(double place, std::size_t& hint) const {
  hint = std::min(hint, u.size() - 2);
  while (hint > 0 && u[hint] > place) --hint;
  while (hint + 2 < u.size() && u[hint + 1] < place) ++hint;
  const double width = u[hint + 1] - u[hint];
  if (!(width > 0.0)) return z[hint + 1];
  return z[hint] + (z[hint + 1] - z[hint]) * ((place - u[hint]) / width);
}

RowCurves::RowCurves(const DropCutter& cutter) : given_(&cutter) {}

RowCurves::RowCurves(const CutSurface& surface, const Eigen::AlignedBox2d& axis,
                     const Executor& executor)
    : stop_(executor.stop_token()), surface_(&surface), axis_(axis) {
  if (surface.bed() == nullptr) made_ = surface.cutter(axis, executor);
}

const DropCutter& RowCurves::facets(int along, std::int64_t number) const {
  Stretch& stretch = [&]() -> Stretch& {
    const std::lock_guard lock(mutex_);
    return stretches_[number];
  }();
  std::call_once(stretch.once, [&] {
    Eigen::AlignedBox2d axis = axis_;
    const auto place = static_cast<double>(number);
    axis.min()[along] = std::max(axis.min()[along], place * kFacetStretch);
    axis.max()[along] = std::min(axis.max()[along], (place + 1.0) * kFacetStretch);
    // On one thread: the others wait here.
    stretch.cutter = surface_->cutter(axis, Executor::serial());
  });
  return *stretch.cutter;
}

/// Makes facets only for the stretches where they are followed.
void RowCurves::follow_facets(const RowSpan& span, double from, double to, double bow,
                              RowProfile& profile) const {
  for (double at = from; at < to;) {
    if (stop_.stop_requested()) throw Interrupted();
    const double number = std::floor(at / kFacetStretch);
    const double end = std::min(to, (number + 1.0) * kFacetStretch);
    const DropCutter& cutter = facets(span.line.along, static_cast<std::int64_t>(number));
    add_facets(cutter, {span.line, span.from, span.to, at, end}, bow, stop_, profile);
    at = end;
  }
}

/// Facets deviate from the surface by at most CutSurface::deviation(). So that the path has no step
/// between them, the facets' curve is lifted by its deviation at its ends and interpolated in
/// between.
void RowCurves::bridge(const RowSpan& span, double from, const CurveNodes* next, double to,
                       double bow, RowProfile& profile) const {
  const std::size_t first = profile.u.size();
  const double begins = profile.z.back();
  follow_facets(span, from, to, bow, profile);
  if (const BallLift* const lift = surface_->lift()) {
    for (std::size_t i = first; i < profile.u.size(); ++i) {
      const Eigen::Vector2d place = span.line.at(profile.u[i]);
      profile.z[i] += lift->at(place, place);
    }
  }
  const double at_end = next != nullptr ? next->z.front() - profile.z.back() : 0.0;
  const double at_begin = first > 1 ? begins - profile.z[first] : at_end;
  const double most = surface_->deviation().height;
  const double left = std::clamp(at_begin, -most, most);
  const double right = std::clamp(next != nullptr ? at_end : at_begin, -most, most);
  for (std::size_t i = first; i < profile.u.size(); ++i) {
    const double part = (profile.u[i] - from) / (to - from);
    profile.z[i] += left + part * (right - left);
  }
}

/// Between two places of known height the drop curve lies below lines that rise from both more
/// steeply than it can, and nowhere above anything that can hold the ball there.
void RowCurves::clear(const RowSpan& span, double from, const CurveNodes* next, double to,
                      RowProfile& profile) const {
  Eigen::AlignedBox2d axis(span.line.at(from));
  axis.extend(span.line.at(to));
  const SmoothBed& bed = *surface_->bed();
  const double highest = bed.bounds().over(bed.footprint(axis)).highest;
  const double before = profile.u.size() > 1 ? profile.z.back() : highest;
  const double after = next != nullptr ? next->z.front() : highest;
  // Lifted ends may be higher. Moves too short for the program's decimals are left out.
  const double top = std::max({highest, before, after}) + kClear;
  const double left = run_of(bed, span.line, from, to, top - before);
  const double right = run_of(bed, span.line, to, from, top - after);
  const auto add = [&](double u, double z) {
    add_node(u, z, profile);
    profile.joints.push_back(u);
  };
  if (left + right + kClear < to - from) {
    add(from + left, top);
    add(to - right, top);
  } else {
    // Both lines meet below the top.
    const double up = (top - before) / left;
    const double down = (top - after) / right;
    const double run = (after - before + down * (to - from)) / (up + down);
    add(from + run, before + up * run);
  }
  add(to, after);
}

/// Stretches end at fixed places. A stretch that cannot be rolled along is halved down to
/// kMinStretch, because shorter ones have tighter bounds. What remains is cut from facets.
void RowCurves::roll(const RowSpan& span, double bow, RowProfile& profile) const {
  SmoothRoll ball(*surface_->bed(), span.line);
  const BallLift* const lift = surface_->lift();
  const double apart = lift != nullptr ? kLiftNodes : HUGE_VAL;
  const double length = kStretch * surface_->radius();
  const double least = kMinStretch * surface_->radius();
  const Eigen::AlignedBox2d inside = off_rim(*surface_->bed());
  std::swap(profile.shaped_from, profile.shaped_to);  // Nothing yet.
  double open = span.held_from;                       // The curve is unknown from here to `begin`.
  double begin = span.held_from;
  while (begin < span.held_to) {
    if (stop_.stop_requested()) throw Interrupted();
    double end = std::min((std::floor(begin / length + kSameStretch) + 1.0) * length, span.held_to);
    std::optional<CurveNodes> nodes = ball.follow(begin, end, profile.finest, apart);
    while (!nodes && end - begin > least) {
      end = 0.5 * (begin + end);
      nodes = ball.follow(begin, end, profile.finest, apart);
    }
    if (nodes) {
      for (std::size_t i = 0; lift != nullptr && i < nodes->z.size(); ++i) {
        nodes->z[i] += lift->at(span.line.at(nodes->u[i]), nodes->contact[i]);
      }
      if (open < begin) pass_over(span, open, &*nodes, begin, bow, profile);
      extend_shaped(*nodes, inside, profile);
      add_nodes(*nodes, bow, lift != nullptr, profile);
      open = end;
    }
    begin = end;
  }
  if (open < begin) pass_over(span, open, nullptr, begin, bow, profile);
}

void RowCurves::pass_over(const RowSpan& span, double from, const CurveNodes* next, double to,
                          double bow, RowProfile& profile) const {
  const Eigen::AlignedBox2d inside = off_rim(*surface_->bed());
  const int along = span.line.along;
  const int other = 1 - along;
  if (span.line.across > inside.min()[other] && span.line.across < inside.max()[other]) {
    for (const double end : {from, to}) {
      extend_shaped(std::clamp(end, inside.min()[along], inside.max()[along]), profile);
    }
  }
  const BallLift* const lift = surface_->lift();
  if (lift != nullptr && lift->clears()) return clear(span, from, next, to, profile);
  bridge(span, from, next, to, bow, profile);
}

RowProfile RowCurves::profile(const RowSpan& span, double bow) const {
  RowProfile profile;
  profile.finest = std::min(kProfileError, kBowShare * bow);
  add_node(span.from, 0.0, profile);
  profile.joints = {span.from, span.held_from};
  if (rolls()) {
    roll(span, bow, profile);
  } else {
    const DropCutter& cutter = given_ != nullptr ? *given_ : *made_;
    add_facets(cutter, span, bow, stop_, profile);
  }
  profile.z.front() = profile.z[1];
  add_node(span.to, profile.z.back(), profile);
  profile.joints.push_back(span.to);
  return profile;
}

namespace {

/// Maximum length of chords of a move's curve with an error of at most `error`, mm: where it is no
/// steeper than at its ends, a circle's curvature is at most ρ²/(ρ² − d²)^1.5, d being the distance
/// from its centre along u.
double longest_chord(const CurvePiece& curve, double error) {
  if (curve.straight()) return HUGE_VAL;
  const double out = std::max(std::abs(curve.begin - curve.u0), std::abs(curve.end - curve.u0));
  const double rise2 = curve.rho2 - out * out;
  if (!(rise2 > CurvePiece::kSteepest * curve.rho2)) return 0.0;
  return std::sqrt(8.0 * error * rise2 * std::sqrt(rise2) / curve.rho2);
}

/// Maximum deviation along z of a controller's path from start to end from the circle through the
/// start: where rounding leaves two radii, some controllers keep the first and jump, others spiral
/// from one to the other.
double radius_slack(const Eigen::Vector2d& start, const RowMove& move, const CurvePiece& curve) {
  const double radius = (start - move.centre).norm();
  const double misfit = std::abs((move.end - move.centre).norm() - radius);
  const double slope =
      std::max(std::abs(curve.slope(start.x())), std::abs(curve.slope(move.end.x())));
  return misfit * std::sqrt(1.0 + slope * slope);
}

}  // namespace

CurvePiece move_curve(const Eigen::Vector2d& start, const RowMove& move) {
  CurvePiece curve{start.x(), move.end.x(), start.x(), start.y()};
  if (!move.arc) {
    curve.rise = (move.end.y() - start.y()) / (move.end.x() - start.x());
    return curve;
  }
  curve.u0 = move.centre.x();
  curve.height = move.centre.y();
  curve.bow = move.cap ? 1.0 : -1.0;
  curve.rate = 1.0;
  curve.rho2 = (start - move.centre).squaredNorm();
  return curve;
}

/// The drop curve's first node beyond a place.
std::size_t RowError::node_after(double u) const {
  std::size_t next = std::min(hint_ + 1, profile_.u.size());
  while (next > 0 && profile_.u[next - 1] > u) --next;
  while (next < profile_.u.size() && profile_.u[next] <= u) ++next;
  return next;
}

/// The error at a move's start; where the drop curve jumps there, that after the jump: the previous
/// move ended before it. @param next  node_after()
double RowError::start_error(const Eigen::Vector2d& start, std::size_t next) const {
  std::size_t hint = std::max<std::size_t>(next, 1) - 1;
  return start.y() - profile_.at(start.x(), hint);
}

/// Appends the nodes of a move, one piece of the drop curve after the other while `go_on()`.
/// @return true if it reached the end.
template <class GoOn>
bool RowError::append(const Eigen::Vector2d& start, const RowMove& move, const GoOn& go_on) {
  const CurvePiece curve = move_curve(start, move);
  const double misfit = move.arc ? radius_slack(start, move, curve) : 0.0;
  const double slack = profile_.error + misfit + (move.arc ? profile_.finest : 0.0);
  std::size_t next = node_after(start.x());
  nodes_.push_back({start.x(), start_error(start, next), slack, start.y()});
  const double chord = longest_chord(curve, profile_.finest);
  double from = start.x();
  for (; next < profile_.u.size() && profile_.u[next] < move.end.x(); ++next) {
    const Eigen::Vector2d to(profile_.u[next], profile_.z[next]);
    if (to.x() - from <= chord) {
      add_node(curve, to, slack);
    } else {
      follow(curve, from, to, slack);
    }
    if (!go_on()) return false;
    from = to.x();
  }
  hint_ = next > 0 ? next - 1 : 0;
  follow(curve, from, {move.end.x(), profile_.at(move.end.x(), hint_)}, slack);
  return go_on();
}

void RowError::add(const Eigen::Vector2d& start, const RowMove& move) {
  append(start, move, [] { return true; });
}

bool RowError::add_within(const Eigen::Vector2d& start, const RowMove& move, double tolerance,
                          double slope_tolerance) {
  const std::size_t first = nodes_.size();
  std::size_t next = first;
  std::size_t back = first;
  const auto holds = [&] {
    for (; next < nodes_.size(); ++next) {
      if (!is_close_at(next, tolerance) || turn_behind(next, back) > slope_tolerance) return false;
    }
    return true;
  };
  return append(start, move, holds) &&
         most_turn_ahead(first, slope_tolerance, true).slope <= slope_tolerance;
}

void RowError::add_node(const CurvePiece& curve, const Eigen::Vector2d& at, double slack) {
  const double path = curve.value(at.x());
  nodes_.push_back({at.x(), path - at.y(), slack, path});
}

/// Appends the nodes from the last one to `to`, a point of the drop curve; the drop curve is
/// straight in between.
void RowError::follow(const CurvePiece& curve, double from, const Eigen::Vector2d& to,
                      double slack) {
  if (bulge(curve, from, to.x()) > profile_.finest) {
    const Node& last = nodes_.back();
    const Eigen::Vector2d begin(from, last.path - last.error);
    const Eigen::Vector2d middle = 0.5 * (begin + to);
    follow(curve, from, middle, slack);
    follow(curve, middle.x(), to, slack);
    return;
  }
  add_node(curve, to, slack);
}

RowError::Error RowError::error_at(double u, std::size_t& hint) const {
  hint = std::min(hint, nodes_.size() - 2);
  while (hint > 0 && nodes_[hint].u > u) --hint;
  while (hint + 2 < nodes_.size() && nodes_[hint + 1].u < u) ++hint;
  const Node& a = nodes_[hint];
  const Node& b = nodes_[hint + 1];
  const double width = b.u - a.u;
  const double error = width > 0.0 ? a.error + (b.error - a.error) * ((u - a.u) / width) : b.error;
  return {error, std::max(a.slack, b.slack)};
}

/// True if the direction shapes the surface at a node and at a distance `way` from it.
bool RowError::shapes(std::size_t node, double way) const {
  return profile_.shapes(nodes_[node].u) && profile_.shapes(nodes_[node].u + way);
}

/// Maximum difference of slope over a stretch with these errors at its ends.
double RowError::turn_between(const Error& a, const Error& b) {
  return (std::abs(a.value - b.value) + a.slack + b.slack) / kSlopeStretch;
}

/// Maximum difference of slope over the stretch before a node; 0 if none is checked.
double RowError::turn_behind(std::size_t node, std::size_t& hint) const {
  const double u = nodes_[node].u - kSlopeStretch;
  if (u < nodes_.front().u || !shapes(node, -kSlopeStretch)) return 0.0;
  return turn_between(error_of(node), error_at(u, hint));
}

/// The maximum over stretches that begin at nodes and end at node `first` or later; stops at one
/// above `enough`.
/// @param goes_on  true if stretches may extend beyond the end, where the error stays constant.
RowError::Turn RowError::most_turn_ahead(std::size_t first, double enough, bool goes_on) const {
  Turn most;
  const double end = nodes_.back().u;
  std::size_t hint = first;
  std::size_t i = first;
  while (i > 0 && nodes_[i - 1].u + kSlopeStretch >= nodes_[first].u) --i;
  for (; i < nodes_.size() && most.slope <= enough; ++i) {
    const double u = nodes_[i].u + kSlopeStretch;
    if (!shapes(i, kSlopeStretch)) continue;
    if (u > end && !goes_on) break;
    const double turn =
        turn_between(error_of(i), u <= end ? error_at(u, hint) : error_of(nodes_.size() - 1));
    if (turn > most.slope) most = {turn, i};
  }
  return most;
}

/// The difference over a stretch is linear between places where one end of it passes a node: it is
/// largest at one of them.
RowError::Turn RowError::most_turn(std::size_t first, double enough, bool goes_on) const {
  if (nodes_.size() < 2) return {};
  Turn most;
  std::size_t hint = first;
  for (std::size_t i = first; i < nodes_.size() && most.slope <= enough; ++i) {
    const double turn = turn_behind(i, hint);
    if (turn > most.slope) most = {turn, i};
  }
  if (most.slope > enough) return most;
  const Turn ahead = most_turn_ahead(first, enough, goes_on);
  return ahead.slope > most.slope ? ahead : most;
}

double RowError::turn(std::size_t first, double enough) const {
  return most_turn(first, enough, true).slope;
}

bool RowError::is_blunt(const Eigen::Vector2d& start, double slope_tolerance) const {
  const double u = start.x() - kSlopeStretch;
  if (nodes_.size() < 2 || u < nodes_.front().u) return false;
  if (!profile_.shapes(u) || !profile_.shapes(start.x())) return false;
  std::size_t back = nodes_.size() - 2;
  // A straight move has the least slack.
  const Error here{start_error(start, node_after(start.x())), profile_.error};
  return turn_between(here, error_at(u, back)) > slope_tolerance;
}

bool RowError::is_close(std::size_t first, double tolerance) const {
  for (std::size_t i = first; i < nodes_.size(); ++i) {
    if (!is_close_at(i, tolerance)) return false;
  }
  return true;
}

PathCertificate RowError::certificate() const {
  PathCertificate certificate;
  const auto place = [](const Node& node) { return Eigen::Vector3d(node.u, node.path, 0.0); };
  for (const Node& node : nodes_) {
    const double gouge = -node.error + node.slack;
    const double excess = node.error + node.slack;
    if (gouge > certificate.gouge.value) certificate.gouge = {gouge, place(node)};
    if (excess > certificate.excess.value) certificate.excess = {excess, place(node)};
  }
  const Turn turn = most_turn(0, HUGE_VAL, false);
  if (turn.slope > 0.0) certificate.slope = {turn.slope, place(nodes_[turn.node])};
  return certificate;
}

}  // namespace lensforge
