// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/row_profile.h"

#include <algorithm>
#include <cmath>

#include "cam/contact/drop_curve.h"
#include "core/decimal_text.h"
#include "core/error.h"

namespace lensforge {
namespace {

/// Arcs are cut no finer than this, mm; only next to a vertical wall is it not fine enough.
constexpr double kFinestStep = 1e-9;

/// Arcs whose slope turns by less than this count as parabolas.
constexpr double kParabolaTurn = 0.1;

/// Gaps up to this length, mm, are rounding.
constexpr double kGap = 1e-8;

[[noreturn]] void throw_nothing_under(const AxisLine& line, double u) {
  const Eigen::Vector2d p = line.at(u);
  throw InputError("surface: nothing under the tool at x " + decimal_text(p.x(), 3) + " y " +
                   decimal_text(p.y(), 3) + " mm; it has to cover the whole lens");
}

void add_node(double u, double z, RowProfile& profile) {
  profile.u.push_back(u);
  profile.z.push_back(z);
}

/// Appends the nodes after `from` up to `to` that keep the polyline within kProfileError.
void follow(const CurvePiece& piece, double from, double to, RowProfile& profile) {
  const double off = bulge(piece, from, to);
  if (off > kProfileError && to - from > kFinestStep) {
    const double middle = 0.5 * (from + to);
    follow(piece, from, middle, profile);
    follow(piece, middle, to, profile);
    return;
  }
  profile.error = std::max(profile.error, off);
  add_node(to, piece.value(to), profile);
}

/// Appends joints after `from` up to `to`. Over a chord a parabola rises by half of what its end
/// tangents rise, by the square of its width; steep arcs are no parabolas and are halved first.
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

void require_cover(const std::vector<CurvePiece>& curve, const RowSpan& span) {
  double covered = span.held_from;
  for (const CurvePiece& piece : curve) {
    if (piece.begin - covered > kGap) break;
    covered = piece.end;
  }
  if (span.held_to - covered > kGap) throw_nothing_under(span.line, covered);
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

RowProfile row_profile(const DropCutter& cutter, const RowSpan& span, double bow) {
  std::vector<CurvePiece> curve = drop_curve(cutter, span.line, span.held_from, span.held_to);
  require_cover(curve, span);
  RowProfile profile;
  profile.u.reserve(4 * curve.size());
  profile.z.reserve(4 * curve.size());
  const double first = curve.front().value(curve.front().begin);
  add_node(span.from, first, profile);
  profile.joints = {span.from, span.held_from};
  add_node(span.held_from, first, profile);
  for (const CurvePiece& piece : curve) {
    // A wall may end in a jump.
    add_node(piece.begin, piece.value(piece.begin), profile);
    follow(piece, piece.begin, piece.end, profile);
    add_joints(piece, piece.begin, piece.end, bow, profile);
  }
  add_node(span.to, profile.z.back(), profile);
  profile.joints.push_back(span.to);
  return profile;
}

}  // namespace lensforge
