// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/curve_envelope.h"

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace lensforge {
namespace {

/// Whether two pieces are one curve but for rounding, as a vertex and an edge that ends there at a
/// right angle to the line are: bounds would tell so only on stretches of a micrometre.
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

/// Whether a line is above the chord of two heights by more than a tie somewhere between them.
bool rises_above(const CurveTangent& line, double from, double at_from, double to, double at_to) {
  return line.at(from) - at_from > kEnvelopeTie || line.at(to) - at_to > kEnvelopeTie;
}

/// Steps of crossing() at most; seven or so are usual.
constexpr std::uintmax_t kCrossingSteps = 60;

/// Where a difference that rises or falls all the way is zero.
double crossing(const CurvePiece& a, const CurvePiece& b, double from, double to,
                const PieceDifference& difference) {
  const auto above = [&](double u) { return a.value(u) - b.value(u); };
  const auto close = [](double low, double high) { return high - low <= kShortestPiece; };
  std::uintmax_t steps = kCrossingSteps;
  const auto [low, high] = boost::math::tools::toms748_solve(above, from, to, difference.at_from,
                                                             difference.at_to, close, steps);
  return 0.5 * (low + high);
}

/// Where to look next when the bounds leave it open who is on top: where the difference's chord
/// crosses zero, else the middle.
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

/// Appends what is on top of all of piece number `i`.
void CurveEnvelope::keep(std::size_t i) {
  const CurvePiece& piece = pieces_[i];
  const bool goes_on = !merged_.empty() && merged_.back().feature == piece.feature;
  if (goes_on) return append(piece, piece.begin, piece.end);
  merged_.push_back(piece);
  merged_ends_.push_back(ends_[i]);
}

/// Whether `fresh` is above piece number `i` by more than a tie anywhere. Between two places the
/// old piece, being concave, is nowhere below its chord and the fresh one nowhere above a tangent.
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

}  // namespace lensforge
