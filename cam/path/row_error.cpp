// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/row_error.h"

#include <algorithm>
#include <cmath>

namespace lensforge {
namespace {

/// Length of the chords of a move's curve that are off by `error` at most, mm: wherever it is
/// no steeper than at its ends, a circle bends by ρ²/(ρ² − d²)^1.5 at most, d being the distance
/// from its centre along u.
double longest_chord(const CurvePiece& curve, double error) {
  if (curve.straight()) return HUGE_VAL;
  const double out = std::max(std::abs(curve.begin - curve.u0), std::abs(curve.end - curve.u0));
  const double rise2 = curve.rho2 - out * out;
  if (!(rise2 > CurvePiece::kSteepest * curve.rho2)) return 0.0;
  return std::sqrt(8.0 * error * rise2 * std::sqrt(rise2) / curve.rho2);
}

/// How far a controller's way from start to end can be off the circle through the start, along z:
/// where rounding leaves two radii, some keep the first and jump, some wind from one to the other.
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

/// The error where a move starts; where the drop curve jumps there, that beyond the jump: the move
/// before it ended below. @param next  node_after()
double RowError::start_error(const Eigen::Vector2d& start, std::size_t next) const {
  std::size_t hint = std::max<std::size_t>(next, 1) - 1;
  return start.y() - profile_.at(start.x(), hint);
}

/// Appends the nodes of a move, one piece of the drop curve after the other while `go_on()`.
/// @return whether it did so to the end.
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

/// Appends the nodes from the last one to `to`, a point of the drop curve between which and the
/// last node the drop curve is straight.
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

/// Whether the direction shapes the surface at a node and `way` from it.
bool RowError::shapes(std::size_t node, double way) const {
  return profile_.shapes(nodes_[node].u) && profile_.shapes(nodes_[node].u + way);
}

/// The difference of slope over a stretch with these errors at its ends, at most.
double RowError::turn_between(const Error& a, const Error& b) {
  return (std::abs(a.value - b.value) + a.slack + b.slack) / kSlopeStretch;
}

/// The difference of slope over the stretch before a node, at most; 0 where none is looked at.
double RowError::turn_behind(std::size_t node, std::size_t& hint) const {
  const double u = nodes_[node].u - kSlopeStretch;
  if (u < nodes_.front().u || !shapes(node, -kSlopeStretch)) return 0.0;
  return turn_between(error_of(node), error_at(u, hint));
}

/// The largest over stretches that begin at nodes and end at node `first` or later; stops at one
/// that is more than enough.
/// @param goes_on  whether stretches may reach beyond the end, where the error stays as it is.
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
RowError::Turn RowError::most_turn(std::size_t first, bool goes_on) const {
  if (nodes_.size() < 2) return {};
  Turn most;
  std::size_t hint = first;
  for (std::size_t i = first; i < nodes_.size(); ++i) {
    const double turn = turn_behind(i, hint);
    if (turn > most.slope) most = {turn, i};
  }
  const Turn ahead = most_turn_ahead(first, HUGE_VAL, goes_on);
  return ahead.slope > most.slope ? ahead : most;
}

double RowError::turn(std::size_t first) const { return most_turn(first, true).slope; }

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
  const Turn turn = most_turn(0, false);
  if (turn.slope > 0.0) certificate.slope = {turn.slope, place(nodes_[turn.node])};
  return certificate;
}

}  // namespace lensforge
