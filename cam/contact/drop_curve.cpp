// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/drop_curve.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "cam/contact/ball_cutter.h"

// Notation: u runs along the line and v across it, v = v* on the line. R is the ball's radius. An
// edge starts at its upper end; e is its direction seen from above, `run` its length seen from
// above, k = u_z / length its incline (≤ 0).

namespace lensforge {
namespace {

/// True if two pieces are the same curve except for rounding, such as a vertex and an edge that
/// ends there at a right angle to the line: bounds would show it only on stretches of a micrometre.
bool same_curve(const CurvePiece& a, const CurvePiece& b, double from, double to) {
  constexpr double kRounding = 1e-13;
  if (std::abs(a.bow - b.bow) > kRounding || std::abs(a.rho2 - b.rho2) > kRounding) return false;
  const auto off = [](const CurvePiece& piece, double u) {
    return piece.offset + piece.rate * (u - piece.u0);
  };
  const double sign = a.rate * b.rate < 0.0 ? -1.0 : 1.0;
  for (const double u : {from, to}) {
    if (std::abs(off(a, u) - sign * off(b, u)) > kRounding) return false;
    if (std::abs(a.height + a.rise * (u - a.u0) - b.height - b.rise * (u - b.u0)) > kRounding) {
      return false;
    }
  }
  return true;
}

/// True if a line is above the chord of two heights by more than a tie somewhere between them.
bool rises_above(const CurveTangent& line, double from, double at_from, double to, double at_to) {
  return line.at(from) - at_from > kEnvelopeTie || line.at(to) - at_to > kEnvelopeTie;
}

/// Maximum steps of crossing(); about seven are usual.
constexpr std::uintmax_t kCrossingSteps = 60;

/// Zero of a difference that rises or falls throughout.
double crossing(const CurvePiece& a, const CurvePiece& b, double from, double to,
                const PieceDifference& difference) {
  const auto above = [&](double u) { return a.value(u) - b.value(u); };
  const auto close = [](double low, double high) { return high - low <= kShortestPiece; };
  std::uintmax_t steps = kCrossingSteps;
  const auto [low, high] = boost::math::tools::toms748_solve(above, from, to, difference.at_from,
                                                             difference.at_to, close, steps);
  return 0.5 * (low + high);
}

/// Next place to evaluate when the bounds do not decide which piece is on top: where the
/// difference's chord crosses zero, else the middle.
double split_point(const PieceDifference& above, double from, double to) {
  if (above.at_from * above.at_to >= 0.0) return 0.5 * (from + to);
  const double part = above.at_from / (above.at_from - above.at_to);
  return from + std::clamp(part, 1e-3, 1.0 - 1e-3) * (to - from);
}

}  // namespace

CurveEnvelope::Ends CurveEnvelope::ends_of(const CurvePiece& piece) {
  return {piece.value(piece.begin), piece.value(piece.end)};
}

/// Appends to merged_; two stretches of one piece become one.
void CurveEnvelope::append(const CurvePiece& piece, double from, double to) {
  if (to - from <= 0.0) return;
  if (!merged_.empty() && merged_.back().feature == piece.feature && merged_.back().end == from) {
    merged_.back().end = to;
    merged_ends_.back().end = piece.value(to);
    return;
  }
  merged_.push_back(piece);
  merged_.back().begin = from;
  merged_.back().end = to;
  merged_ends_.push_back(ends_of(merged_.back()));
}

/// Appends all of piece number `i` that stays on top.
void CurveEnvelope::keep(std::size_t i) {
  const CurvePiece& piece = pieces_[i];
  const bool goes_on = !merged_.empty() && merged_.back().feature == piece.feature;
  if (goes_on) return append(piece, piece.begin, piece.end);
  merged_.push_back(piece);
  merged_ends_.push_back(ends_[i]);
}

/// True if `fresh` may be above piece number `i` by more than a tie anywhere. Between two places
/// the old piece, being concave, is nowhere below its chord and the fresh one nowhere above a
/// tangent.
/// @param tangent  of `fresh` somewhere.
bool CurveEnvelope::may_rise_above(const CurvePiece& fresh, const CurveTangent& tangent,
                                   std::size_t i) const {
  const CurvePiece& old = pieces_[i];
  const Ends& ends = ends_[i];
  if (!rises_above(tangent, old.begin, ends.begin, old.end, ends.end)) return false;
  const double from = std::max(fresh.begin, old.begin);
  const double to = std::min(fresh.end, old.end);
  if (to - from <= kShortestPiece) return false;
  const double at_from = from > old.begin ? old.value(from) : ends.begin;
  const double at_to = to < old.end ? old.value(to) : ends.end;
  const CurveTangent middle = fresh.tangent(0.5 * (from + to));
  return rises_above(middle, from, at_from, to, at_to) &&
         difference(fresh, old, from, to).high > kEnvelopeTie && !same_curve(fresh, old, from, to);
}

void CurveEnvelope::contest(const CurvePiece& old, const CurvePiece& fresh, double from,
                            double to) {
  const PieceDifference above = difference(fresh, old, from, to);
  if (above.high <= kEnvelopeTie || to - from <= kShortestPiece) return append(old, from, to);
  if (above.low >= 0.0) return append(fresh, from, to);
  const bool crosses = (above.at_from > 0.0) != (above.at_to > 0.0);
  if (above.monotone && crosses) {
    const double place = crossing(fresh, old, from, to, above);
    append(above.at_from > 0.0 ? fresh : old, from, place);
    return append(above.at_from > 0.0 ? old : fresh, place, to);
  }
  if (above.monotone) return append(above.at_from > 0.0 ? fresh : old, from, to);
  if (same_curve(fresh, old, from, to)) return append(old, from, to);
  const double middle = split_point(above, from, to);
  contest(old, fresh, from, middle);
  contest(old, fresh, middle, to);
}

void CurveEnvelope::insert(const CurvePiece& piece) {
  const CurveTangent tangent = piece.tangent(0.5 * (piece.begin + piece.end));
  double covered = piece.begin;
  bool on_top = false;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const CurvePiece& old = pieces_[i];
    if (old.end <= piece.begin || old.begin >= piece.end) continue;
    on_top = on_top || old.begin > covered || may_rise_above(piece, tangent, i);
    covered = std::max(covered, old.end);
  }
  if (!on_top && covered >= piece.end) return;

  merged_.clear();
  merged_ends_.clear();
  double at = piece.begin;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const CurvePiece& old = pieces_[i];
    if (old.end <= piece.begin) {
      keep(i);
      continue;
    }
    append(piece, at, std::min(old.begin, piece.end));
    if (old.begin >= piece.end) {
      at = piece.end;
      keep(i);
      continue;
    }
    const double from = std::max(old.begin, piece.begin);
    const double to = std::min(old.end, piece.end);
    append(old, old.begin, from);
    contest(old, piece, from, to);
    append(old, to, old.end);
    at = to;
  }
  append(piece, at, piece.end);
  pieces_.swap(merged_);
  ends_.swap(merged_ends_);
}

namespace {

/// Length of the stretches searched one at a time, in radii: longer ones have more contenders each,
/// shorter ones repeat them more often. A row of the benchmark's lens takes 9 ms on its facets and
/// 370 ms on its smooth surface with 0.1 R, 6 and 800 ms with 0.3 R.
constexpr double kStretchPerRadius = 0.1;

/// Shorter remainders, mm, are searched with the neighbouring stretch: no facet would be found on
/// them.
constexpr double kShortestStretch = 1e-6;

/// Edges steeper than this, run ÷ length, are replaced by their upper vertex: the ball changes
/// between the two within R · 1e-6.
constexpr double kSteepEdge = 1e-6;

/// Rounding allowance, mm or mm², of the quick tests for contact with an edge or corner.
constexpr double kTouchMargin = 1e-9;

/// Minimum length of a facet's line, mm; shorter ones are replaced by the facet's edges.
constexpr double kShortestFacet = 1e-10;

/// Pieces shorter than this, mm, are not part of the curve.
constexpr double kSlit = 1e-9;

/// Pieces of which the curve is the largest.
using Offers = std::vector<CurvePiece>;

struct Stretch {
  AxisLine line;
  double radius;
  double from, to;

  [[nodiscard]] double u(const Eigen::Vector2d& p) const { return p[line.along]; }
  [[nodiscard]] double v(const Eigen::Vector2d& p) const { return p[1 - line.along]; }
};

/// Contact of the ball with a facet's plane with its axis at both ends of a stretch; linear
/// between.
struct PlaneContact {
  std::array<double, 3> from{};  ///< Barycentric.
  std::array<double, 3> to{};
};

PlaneContact plane_contact(const FacetContact& facet, const Stretch& stretch) {
  const Barycentric a = contact_point(facet, stretch.line.at(stretch.from));
  const Barycentric b = contact_point(facet, stretch.line.at(stretch.to));
  return {{a.a, a.b, a.c}, {b.a, b.b, b.c}};
}

/// Narrows begin … end to where the tangent contact lies inside the facet.
bool clip_to_facet(const PlaneContact& contact, CurvePiece& piece) {
  double low = 0.0;
  double high = 1.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double from = contact.from[k] + kFacetMargin;
    const double to = contact.to[k] + kFacetMargin;
    if (from < 0.0 && to < 0.0) return false;
    if (from < 0.0) low = std::max(low, from / (from - to));
    if (to < 0.0) high = std::min(high, from / (from - to));
  }
  const double begin = piece.begin;
  const double width = piece.end - piece.begin;
  if (low > 0.0) piece.begin = begin + low * width;
  if (high < 1.0) piece.end = begin + high * width;
  return piece.end - piece.begin > kShortestFacet;
}

void offer_facet(const Contender& contender, const Stretch& stretch, Offers& offers) {
  const FacetContact& facet = *contender.facet;
  if (facet.shape == FacetShape::kNone) return;
  CurvePiece piece;
  piece.begin = stretch.from;
  piece.end = stretch.to;
  if (!clip_to_facet(plane_contact(facet, stretch), piece)) return;
  piece.feature = std::int64_t{8} * contender.triangle;
  if (facet.shape == FacetShape::kRegular) {
    piece.u0 = stretch.u(facet.origin);
    piece.rise = stretch.u(facet.slope);
    piece.height =
        facet.tip + stretch.v(facet.slope) * (stretch.line.across - stretch.v(facet.origin));
  } else {
    // Heights at points of the facet itself: never above the true ones.
    const auto tip = [&](double u) {
      const Eigen::Vector2d p = stretch.line.at(u);
      const Eigen::Matrix3d& corners = *contender.corners;
      return tip_at(contact_point(facet, p), p, stretch.radius, corners.col(0), corners.col(1),
                    corners.col(2));
    };
    piece.u0 = piece.begin;
    piece.height = tip(piece.begin);
    piece.rise = (tip(piece.end) - piece.height) / (piece.end - piece.begin);
    if (!std::isfinite(piece.rise) || !std::isfinite(piece.height)) return;
  }
  offers.push_back(piece);
}

/// Narrows begin … end to where the line passes under the ball's flank.
bool clip_arc(CurvePiece& piece) {
  const double most = std::sqrt(piece.rho2 * (1.0 - CurvePiece::kSteepest));
  if (piece.rate == 0.0) return std::abs(piece.offset) <= most && piece.end > piece.begin;
  const double a = piece.u0 + (-most - piece.offset) / piece.rate;
  const double b = piece.u0 + (most - piece.offset) / piece.rate;
  piece.begin = std::max(piece.begin, std::min(a, b));
  piece.end = std::min(piece.end, std::max(a, b));
  return piece.end > piece.begin;
}

/// True if a ball on the stretch can rest on corner q of a triangle with another corner `other`:
/// from q the edge there must lead away from the ball's centre, (p − q, √(R² − |p − q|²))
/// · (other − q) ≤ 0.
bool may_rest_on(const Eigen::Vector3d& q, const Eigen::Vector3d& other, const CurvePiece& arc,
                 const Stretch& stretch) {
  const Eigen::Vector3d way = other - q;
  const double from = arc.begin - arc.u0;
  const double to = arc.end - arc.u0;
  const double low = std::sqrt(std::max(arc.rho2 - std::max(from * from, to * to), 0.0));
  const double nearest = std::clamp(0.0, from, to);
  const double high = std::sqrt(std::max(arc.rho2 - nearest * nearest, 0.0));
  const double along = stretch.u(way.head<2>());
  const double across = stretch.v(way.head<2>()) * (stretch.line.across - stretch.v(q.head<2>()));
  const double least =
      std::min(along * from, along * to) + across + std::min(way.z() * low, way.z() * high);
  return least <= kTouchMargin;
}

void offer_vertex(const Eigen::Matrix3d& corners, int k, std::int64_t feature,
                  const Stretch& stretch, Offers& offers) {
  const Eigen::Vector3d q = corners.col(k);
  const double off = stretch.line.across - stretch.v(q.head<2>());
  CurvePiece piece{stretch.from, stretch.to};
  piece.rho2 = stretch.radius * stretch.radius - off * off;
  if (!(piece.rho2 > 0.0)) return;
  piece.u0 = stretch.u(q.head<2>());
  piece.height = q.z() - stretch.radius;
  piece.bow = 1.0;
  piece.rate = 1.0;
  piece.feature = feature;
  if (!clip_arc(piece)) return;
  if (!may_rest_on(q, corners.col((k + 1) % 3), piece, stretch)) return;
  if (!may_rest_on(q, corners.col((k + 2) % 3), piece, stretch)) return;
  offers.push_back(piece);
}

/// An edge as the ball sees it from the line.
struct Edge {
  CurvePiece piece;
  double run = 0.0;
  double k = 0.0;
  double e_u = 0.0, e_v = 0.0;
  double v_top = 0.0;  ///< v* − v of the upper end.

  /// Contact along the edge, 0 … run from its upper end.
  [[nodiscard]] double touch(double u, double radius) const {
    const double t = u - piece.u0;
    const double d = e_u * v_top - e_v * t;
    return e_u * t + e_v * v_top + k * std::sqrt(std::max(radius * radius - d * d, 0.0));
  }
};

/// Quick test: false if a ball on the piece cannot touch the edge between its ends.
bool may_touch(const Edge& edge) {
  const CurvePiece& piece = edge.piece;
  const double d_from = piece.offset + piece.rate * (piece.begin - piece.u0);
  const double d_to = piece.offset + piece.rate * (piece.end - piece.u0);
  const double farthest = std::max(d_from * d_from, d_to * d_to);
  const double nearest = d_from * d_to <= 0.0 ? 0.0 : std::min(d_from * d_from, d_to * d_to);
  const double low = edge.k * std::sqrt(std::max(piece.rho2 - nearest, 0.0));
  const double high = edge.k * std::sqrt(std::max(piece.rho2 - farthest, 0.0));
  const double rest = edge.e_v * edge.v_top;
  const double s_from = edge.e_u * (piece.begin - piece.u0) + rest;
  const double s_to = edge.e_u * (piece.end - piece.u0) + rest;
  return std::max(s_from, s_to) + high >= -kTouchMargin &&
         std::min(s_from, s_to) + low <= edge.run + kTouchMargin;
}

Edge make_edge(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Stretch& stretch) {
  const bool a_on_top = a.z() > b.z() || (a.z() == b.z() && a.x() > b.x());
  const Eigen::Vector3d& top = a_on_top ? a : b;
  const Eigen::Vector3d way = (a_on_top ? b : a) - top;
  Edge edge;
  edge.run = way.head<2>().norm();
  const double length = way.norm();
  if (!(edge.run > kSteepEdge * length)) return Edge{};
  edge.k = way.z() / length;
  edge.e_u = stretch.u(way.head<2>()) / edge.run;
  edge.e_v = stretch.v(way.head<2>()) / edge.run;
  edge.v_top = stretch.line.across - stretch.v(top.head<2>());
  const double incline = way.z() / edge.run;
  edge.piece.u0 = stretch.u(top.head<2>());
  edge.piece.height = top.z() - stretch.radius + incline * edge.e_v * edge.v_top;
  edge.piece.rise = incline * edge.e_u;
  edge.piece.bow = length / edge.run;
  edge.piece.rho2 = stretch.radius * stretch.radius;
  edge.piece.offset = edge.e_u * edge.v_top;
  edge.piece.rate = -edge.e_v;
  edge.piece.begin = stretch.from;
  edge.piece.end = stretch.to;
  return edge;
}

/// Appends the places on the line where the ball touches the edge at c: touch(u) = c squares to
/// (s_u − c)² + k² d² = k² R², a quadratic A t² + 2 B t + C = 0 with B² − AC = k² (A R² − w²), w
/// being the line's distance from that point of the edge across the line.
void add_crossings(const Edge& edge, double c, double radius, std::vector<double>& places) {
  const double k2 = edge.k * edge.k;
  const double a = edge.e_u * edge.e_u + k2 * edge.e_v * edge.e_v;
  const double w = edge.v_top - c * edge.e_v;
  const double rest = a * radius * radius - w * w;
  if (!(a > 0.0)) return;
  const double b = edge.e_u * (edge.e_v * edge.v_top - c) - k2 * edge.e_u * edge.v_top * edge.e_v;
  const double root = std::abs(edge.k) * std::sqrt(std::max(rest, 0.0));
  places.push_back(edge.piece.u0 + (-b - root) / a);
  places.push_back(edge.piece.u0 + (-b + root) / a);
}

void offer_edge(const Eigen::Vector3d& a, const Eigen::Vector3d& b, std::int64_t feature,
                const Stretch& stretch, Offers& offers) {
  Edge edge = make_edge(a, b, stretch);
  if (edge.run == 0.0) return;
  edge.piece.feature = feature;
  if (!clip_arc(edge.piece) || !may_touch(edge)) return;
  std::vector<double> places{edge.piece.begin, edge.piece.end};
  add_crossings(edge, 0.0, stretch.radius, places);
  add_crossings(edge, edge.run, stretch.radius, places);
  for (double& place : places) place = std::clamp(place, edge.piece.begin, edge.piece.end);
  std::sort(places.begin(), places.end());
  CurvePiece piece = edge.piece;
  for (std::size_t i = 1; i < places.size(); ++i) {
    if (places[i] - places[i - 1] <= kShortestPiece) continue;
    const double touch = edge.touch(0.5 * (places[i] + places[i - 1]), stretch.radius);
    if (touch < 0.0 || touch > edge.run) continue;
    piece.begin = places[i - 1];
    piece.end = places[i];
    offers.push_back(piece);
  }
}

/// Edges and corners of a triangle that can hold the ball on the stretch: as in DropCutter, none
/// that a regular facet's tangent contact lies on the near side of throughout.
ContactFeatures boundary_in_play(const Contender& contender, const Stretch& stretch) {
  const FacetContact& facet = *contender.facet;
  if (facet.shape != FacetShape::kRegular) return contender.features;
  const PlaneContact contact = plane_contact(facet, stretch);
  std::array<double, 3> across{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t corner = (k + 2) % 3;
    across[k] = std::min(contact.from[corner], contact.to[corner]);
  }
  ContactFeatures features = contender.features;
  for (int k = 0; k < 3; ++k) {
    if (across[static_cast<std::size_t>(k)] >= 0.0) {
      features &= static_cast<ContactFeatures>(~edge_bit(k));
    }
  }
  const bool inside = *std::min_element(across.begin(), across.end()) >= 0.0;
  return inside ? ContactFeatures{0} : features;
}

void offer_boundary(const Contender& contender, const Stretch& stretch, Offers& offers) {
  const ContactFeatures features = boundary_in_play(contender, stretch);
  const Eigen::Matrix3d& corners = *contender.corners;
  const std::int64_t first = std::int64_t{8} * contender.triangle;
  for (int k = 0; k < 3; ++k) {
    if ((features & edge_bit(k)) == 0) continue;
    offer_edge(corners.col(k), corners.col((k + 1) % 3), first + 1 + k, stretch, offers);
  }
  for (int k = 0; k < 3; ++k) {
    if ((features & corner_bit(k)) == 0) continue;
    offer_vertex(corners, k, first + 4 + k, stretch, offers);
  }
}

/// Sorts the highest to the front, which saves merging most of the others. Heights are measured
/// from a line with the pieces' mean slope.
void put_highest_first(Offers& offers) {
  double slope = 0.0;
  std::vector<std::pair<double, std::size_t>> order;
  std::vector<CurveTangent> middles;
  for (const CurvePiece& piece : offers) {
    middles.push_back(piece.tangent(0.5 * (piece.begin + piece.end)));
    slope += middles.back().slope / static_cast<double>(offers.size());
  }
  for (std::size_t i = 0; i < offers.size(); ++i) {
    order.emplace_back(slope * middles[i].u - middles[i].height, i);
  }
  std::sort(order.begin(), order.end());
  Offers sorted;
  sorted.reserve(offers.size());
  for (const auto& [below, i] : order) sorted.push_back(offers[i]);
  offers.swap(sorted);
}

/// Appends the pieces of a stretch. Slits are left out: the feature that held the ball there was
/// too short on this stretch to be searched, and lower ones show through. Gaps go to the previous
/// piece.
void append(const std::vector<CurvePiece>& pieces, std::vector<CurvePiece>& curve) {
  for (const CurvePiece& piece : pieces) {
    if (piece.end - piece.begin < kSlit) continue;
    if (!curve.empty() && piece.begin - curve.back().end < 4.0 * kSlit) {
      if (curve.back().feature == piece.feature) {
        curve.back().end = piece.end;
        continue;
      }
      curve.back().end = piece.begin;
    }
    curve.push_back(piece);
  }
}

/// Extends the outermost pieces to the ends that they miss by slits.
void close_ends(double from, double to, std::vector<CurvePiece>& curve) {
  if (curve.empty()) return;
  if (curve.front().begin - from < 4.0 * kSlit) curve.front().begin = from;
  if (to - curve.back().end < 4.0 * kSlit) curve.back().end = to;
}

}  // namespace

std::vector<CurvePiece> drop_curve(const DropCutter& cutter, const AxisLine& line, double from,
                                   double to) {
  std::vector<CurvePiece> curve;
  std::vector<Contender> contenders;
  Offers offers;
  CurveEnvelope envelope;
  // Stretches end at fixed places, so that a line has the same curve whatever part of it is
  // requested.
  const double length = kStretchPerRadius * cutter.radius();
  double begin = from;
  CutterLocation at = cutter.drop(line.at(begin));
  for (auto i = static_cast<std::int64_t>(std::floor(from / length)); begin < to; ++i) {
    double end = static_cast<double>(i + 1) * length;
    if (to - end < kShortestStretch) end = to;
    if (end - begin < kShortestStretch && end < to) continue;
    const Stretch stretch{line, cutter.radius(), begin, end};
    at = cutter.find_contenders(line.at(begin), at, line.at(end), contenders);
    offers.clear();
    for (const Contender& one : contenders) offer_facet(one, stretch, offers);
    for (const Contender& one : contenders) offer_boundary(one, stretch, offers);
    put_highest_first(offers);
    envelope.clear();
    for (const CurvePiece& one : offers) envelope.insert(one);
    append(envelope.pieces(), curve);
    begin = end;
  }
  close_ends(from, to, curve);
  return curve;
}

}  // namespace lensforge
