// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/contact/curve_envelope.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

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

/// Whether `fresh` is above `old` by more than a tie anywhere, by one quick test.
bool may_rise_above(const CurvePiece& fresh, const CurvePiece& old) {
  const double from = std::max(fresh.begin, old.begin);
  const double to = std::min(fresh.end, old.end);
  if (to - from <= kShortestPiece) return false;
  return difference_bounds(fresh, old, from, to).high > kEnvelopeTie &&
         !same_curve(fresh, old, from, to);
}

/// Where to look next when the bounds leave it open who is on top: where the difference's chord
/// crosses zero, else the middle.
double split_point(const CurvePiece& a, const CurvePiece& b, double from, double to) {
  const double at_from = a.value(from) - b.value(from);
  const double at_to = a.value(to) - b.value(to);
  if (at_from * at_to >= 0.0) return 0.5 * (from + to);
  const double part = at_from / (at_from - at_to);
  return from + std::clamp(part, 1e-3, 1.0 - 1e-3) * (to - from);
}

}  // namespace

/// Appends to merged_; two stretches of one piece become one.
void CurveEnvelope::append(const CurvePiece& piece, double from, double to) {
  if (to - from <= 0.0) return;
  if (!merged_.empty() && merged_.back().feature == piece.feature && merged_.back().end == from) {
    merged_.back().end = to;
    return;
  }
  merged_.push_back(piece);
  merged_.back().begin = from;
  merged_.back().end = to;
}

void CurveEnvelope::contest(const CurvePiece& old, const CurvePiece& fresh, double from,
                            double to) {
  const Range above = difference_bounds(fresh, old, from, to);
  if (above.high <= kEnvelopeTie || to - from <= kShortestPiece) return append(old, from, to);
  if (above.low >= 0.0) return append(fresh, from, to);
  if (same_curve(fresh, old, from, to)) return append(old, from, to);
  const double middle = split_point(fresh, old, from, to);
  contest(old, fresh, from, middle);
  contest(old, fresh, middle, to);
}

void CurveEnvelope::insert(const CurvePiece& piece) {
  double covered = piece.begin;
  bool on_top = false;
  for (const CurvePiece& old : pieces_) {
    if (old.end <= piece.begin || old.begin >= piece.end) continue;
    on_top = on_top || old.begin > covered || may_rise_above(piece, old);
    covered = std::max(covered, old.end);
  }
  if (!on_top && covered >= piece.end) return;

  merged_.clear();
  double at = piece.begin;
  for (const CurvePiece& old : pieces_) {
    if (old.end <= piece.begin) {
      append(old, old.begin, old.end);
      continue;
    }
    append(piece, at, std::min(old.begin, piece.end));
    if (old.begin >= piece.end) {
      at = piece.end;
      append(old, old.begin, old.end);
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
}

}  // namespace lensforge
