// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_arc.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace lensforge {
namespace {

using Plane = std::complex<double>;
constexpr double kTurn = 2.0 * std::numbers::pi;

int real_axis(int plane) { return plane == 17 ? 0 : plane == 18 ? 2 : 1; }
int imaginary_axis(int plane) { return plane == 17 ? 1 : plane == 18 ? 0 : 2; }
int normal_axis(int plane) { return plane == 17 ? 2 : plane == 18 ? 1 : 0; }

Plane flat(const Eigen::Vector3d& point, int plane) {
  return {point[real_axis(plane)], point[imaginary_axis(plane)]};
}

/// The turn from one arm to the other, never nothing.
double turn_between(Plane from, Plane to, bool clockwise) {
  double turn = std::arg(to / from);
  if (clockwise && turn >= -5e-7) turn -= kTurn;
  if (!clockwise && turn <= 5e-7) turn += kTurn;
  return turn;
}

/// Centre = middle + i·h·chord/|chord|; h > 0 puts it on the left.
int centre_by_radius(Plane start, Plane end, const SimArcWords& words, Plane& centre) {
  const Plane chord = end - start;
  if (std::abs(chord) == 0.0) return 33;
  const double r = *words.radius;
  const double square = 4.0 * r * r - std::norm(chord);
  if (square < -1e-9 * std::norm(chord)) return 34;
  double h = 0.5 * std::sqrt(std::max(0.0, square));
  if (words.clockwise != (r < 0.0)) h = -h;
  centre = 0.5 * (start + end) + Plane(0.0, h) * chord / std::abs(chord);
  return 0;
}

bool radii_differ(double first, double second) {
  const double error = std::abs(first - second);
  return error > 0.005 && (error > 0.5 || error > 0.001 * first);
}

}  // namespace

Eigen::Vector3d SimArc::chord_end(int chord) const {
  if (chord >= chords) return end;
  const double share = double(chord) / chords;
  const Plane middle = flat(centre, plane);
  const Plane point = middle + (flat(start, plane) - middle) * std::polar(1.0, turn * share);
  Eigen::Vector3d result;
  result[real_axis(plane)] = point.real();
  result[imaginary_axis(plane)] = point.imag();
  const int normal = normal_axis(plane);
  result[normal] = start[normal] + share * (end[normal] - start[normal]);
  return result;
}

double SimArc::length() const {
  const double radius = std::abs(flat(start, plane) - flat(centre, plane));
  const int normal = normal_axis(plane);
  return std::hypot(radius * turn, end[normal] - start[normal]);
}

int lay_arc(const Eigen::Vector3d& start, const Eigen::Vector3d& end, const SimArcWords& words,
            SimArc& arc) {
  arc.start = start;
  arc.end = end;
  arc.plane = words.plane;
  const Plane from = flat(start, words.plane);
  const Plane to = flat(end, words.plane);
  Plane centre = from + flat(words.offset, words.plane);
  if (words.radius) {
    if (const int error = centre_by_radius(from, to, words, centre); error != 0) return error;
  } else if (std::abs(from - centre) == 0.0 ||
             radii_differ(std::abs(from - centre), std::abs(to - centre))) {
    return 33;
  }
  arc.centre[real_axis(words.plane)] = centre.real();
  arc.centre[imaginary_axis(words.plane)] = centre.imag();
  arc.turn = turn_between(from - centre, to - centre, words.clockwise);
  const double radius = std::abs(from - centre);
  const double half_chord = std::sqrt(words.tolerance * (2.0 * radius - words.tolerance));
  const double count = std::abs(0.5 * arc.turn * radius) / half_chord;
  arc.chords = half_chord > 0.0 ? std::max(1, static_cast<int>(count)) : 1;
  return 0;
}

}  // namespace lensforge
