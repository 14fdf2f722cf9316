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

void RowError::add(const Eigen::Vector2d& start, const RowMove& move) {
  const CurvePiece curve = move_curve(start, move);
  const double misfit = move.arc ? radius_slack(start, move, curve) : 0.0;
  const double slack = profile_.error + misfit + (move.arc ? profile_.finest : 0.0);
  std::size_t hint = hint_;
  const double first = profile_.at(start.x(), hint);
  nodes_.push_back({start.x(), start.y() - first, slack, start.y()});
  std::size_t next = hint + 1;
  while (next > 0 && profile_.u[next - 1] > start.x()) --next;
  const double chord = longest_chord(curve, profile_.finest);
  double from = start.x();
  for (; next < profile_.u.size() && profile_.u[next] < move.end.x(); ++next) {
    if (profile_.u[next] <= start.x()) continue;
    const Eigen::Vector2d to(profile_.u[next], profile_.z[next]);
    if (to.x() - from <= chord) {
      add_node(curve, to, slack);
    } else {
      follow(curve, from, to, slack);
    }
    from = to.x();
  }
  hint_ = next > 0 ? next - 1 : 0;
  follow(curve, from, {move.end.x(), profile_.at(move.end.x(), hint_)}, slack);
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

double RowError::error_at(double u, std::size_t& hint, double& slack) const {
  hint = std::min(hint, nodes_.size() - 2);
  while (hint > 0 && nodes_[hint].u > u) --hint;
  while (hint + 2 < nodes_.size() && nodes_[hint + 1].u < u) ++hint;
  const Node& a = nodes_[hint];
  const Node& b = nodes_[hint + 1];
  slack = std::max(a.slack, b.slack);
  const double width = b.u - a.u;
  return width > 0.0 ? a.error + (b.error - a.error) * ((u - a.u) / width) : b.error;
}

/// The difference over a stretch is linear between places where one end of it passes a node: it is
/// largest at one of them. Stops at the first that is more than enough.
/// @param goes_on  whether stretches may reach beyond the end, where the error stays as it is.
RowError::Turn RowError::most_turn(std::size_t first, double enough, bool goes_on) const {
  Turn most;
  if (nodes_.size() < 2) return most;
  const double begin = nodes_.front().u;
  const double end = nodes_.back().u;
  const auto shapes = [&](std::size_t node, double way) {
    return profile_.shapes(nodes_[node].u) && profile_.shapes(nodes_[node].u + way);
  };
  const auto offer = [&](std::size_t node, double other, double slack) {
    const double turn =
        (std::abs(nodes_[node].error - other) + nodes_[node].slack + slack) / kSlopeStretch;
    if (turn > most.slope) most = {turn, node};
  };
  std::size_t back = first;
  double slack = 0.0;
  for (std::size_t i = first; i < nodes_.size() && most.slope <= enough; ++i) {
    const double u = nodes_[i].u - kSlopeStretch;
    if (u >= begin && shapes(i, -kSlopeStretch)) offer(i, error_at(u, back, slack), slack);
  }
  std::size_t ahead = first;
  std::size_t i = first;
  while (i > 0 && nodes_[i - 1].u + kSlopeStretch >= nodes_[first].u) --i;
  for (; i < nodes_.size() && most.slope <= enough; ++i) {
    const double u = nodes_[i].u + kSlopeStretch;
    if (!shapes(i, kSlopeStretch)) continue;
    if (u <= end) {
      offer(i, error_at(u, ahead, slack), slack);
    } else if (goes_on) {
      offer(i, nodes_.back().error, nodes_.back().slack);
    } else {
      break;
    }
  }
  return most;
}

bool RowError::holds(std::size_t first, double tolerance, double slope_tolerance) const {
  for (std::size_t i = first; i < nodes_.size(); ++i) {
    if (std::abs(nodes_[i].error) + nodes_[i].slack > tolerance) return false;
  }
  return most_turn(first, slope_tolerance, true).slope <= slope_tolerance;
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
