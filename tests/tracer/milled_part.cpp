// SPDX-License-Identifier: GPL-3.0-or-later
#include "tracer/milled_part.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace tracer {
namespace {

/// The ball's centre goes straight from one place to another.
struct Sweep {
  Vec3 from;
  Vec3 to;
  double radius;

  /// Lowest point of the ball over q on its way, if it gets there. The centre of the ball that is
  /// lowest over q is off its foot by the slope of the way.
  [[nodiscard]] double lowest(const Vec2& q, double otherwise) const {
    const Vec2 way = (to - from).head<2>();
    const double length = way.norm();
    const Vec2 u = length > 0.0 ? Vec2(way / length) : Vec2(1.0, 0.0);
    const Vec2 off = q - from.head<2>();
    const double along = off.dot(u);
    const double beside = u.x() * off.y() - u.y() * off.x();
    const double chord = radius * radius - beside * beside;
    if (chord < 0.0) return otherwise;
    if (length == 0.0) return lowest_at(along, 0.0, chord, 0.0, otherwise);
    const double slope = (to.z() - from.z()) / length;
    const double best = along - slope * std::sqrt(chord / (1.0 + slope * slope));
    return lowest_at(along, std::clamp(best, 0.0, length), chord, slope, otherwise);
  }

 private:
  [[nodiscard]] double lowest_at(double along, double centre, double chord, double slope,
                                 double otherwise) const {
    const double square = chord - (along - centre) * (along - centre);
    return square < 0.0 ? otherwise : from.z() + slope * centre - std::sqrt(square);
  }
};

void cut(const Sweep& sweep, Heights& blank) {
  const auto range = [&](int axis, int count) {
    const double low = std::min(sweep.from[axis], sweep.to[axis]) - sweep.radius;
    const double high = std::max(sweep.from[axis], sweep.to[axis]) + sweep.radius;
    const double first = std::ceil((low - blank.origin[axis]) / blank.step);
    const double last = std::floor((high - blank.origin[axis]) / blank.step);
    return std::array<int, 2>{static_cast<int>(std::max(first, 0.0)),
                              static_cast<int>(std::min(last, count - 1.0))};
  };
  const auto columns = range(0, blank.columns);
  const auto rows = range(1, blank.rows);
  for (int j = rows[0]; j <= rows[1]; ++j) {
    for (int i = columns[0]; i <= columns[1]; ++i) {
      double& z = blank.at(i, j);
      z = std::min(z, sweep.lowest(blank.place(i, j), z));
    }
  }
}

/// Cuts along an arc around `centre` in the plane of x (or y) and z, in chords that stay within
/// half a nanometre of it.
void cut_arc(const Vec3& from, const Vec3& to, const Vec3& centre, int axis, double radius,
             Heights& blank) {
  constexpr double kSagitta = 5e-7;
  const auto angle = [&](const Vec3& p) {
    return std::atan2(p.z() - centre.z(), p[axis] - centre[axis]);
  };
  const double around = std::hypot(from[axis] - centre[axis], from.z() - centre.z());
  const double sweep = std::remainder(angle(to) - angle(from), 2.0 * M_PI);
  const double widest = 2.0 * std::acos(1.0 - std::min(kSagitta / around, 1.0));
  const int parts = std::max(1, static_cast<int>(std::ceil(std::abs(sweep) / widest)));
  Vec3 at = from;
  for (int k = 1; k <= parts; ++k) {
    Vec3 next = to;
    if (k < parts) {
      const double turn = angle(from) + sweep * k / parts;
      next[axis] = centre[axis] + around * std::cos(turn);
      next.z() = centre.z() + around * std::sin(turn);
    }
    cut({at, next, radius}, blank);
    at = next;
  }
}

[[noreturn]] void refuse(const std::string& program, int line, const std::string& what) {
  throw std::runtime_error(program + ":" + std::to_string(line) + ": " + what);
}

/// Without comments and blanks.
std::string words_of(const std::string& line) {
  std::string words;
  bool comment = false;
  for (const char c : line) {
    if (c == ';' || c == '%') break;
    if (c == '(') comment = true;
    if (!comment && std::isspace(static_cast<unsigned char>(c)) == 0) words += c;
    if (c == ')') comment = false;
  }
  return words;
}

/// Weights 0, 1, … nodes away.
std::vector<double> gaussian(double sigma, double step) {
  std::vector<double> weights;
  double sum = 0.0;
  for (int k = 0; k * step <= 5.0 * sigma; ++k) {
    const double t = k * step / sigma;
    weights.push_back(std::exp(-0.5 * t * t));
    sum += (k == 0 ? 1.0 : 2.0) * weights.back();
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// Averages along x and turns the grid over its diagonal.
Heights averaged(const Heights& part, const std::vector<double>& weights) {
  Heights turned = part;
  std::swap(turned.columns, turned.rows);
  std::swap(turned.origin.x(), turned.origin.y());
  const int reach = static_cast<int>(weights.size()) - 1;
  for (int j = 0; j < part.rows; ++j) {
    for (int i = 0; i < part.columns; ++i) {
      double sum = part.at(i, j);
      if (i >= reach && i + reach < part.columns) {
        sum *= weights[0];
        for (int k = 1; k <= reach; ++k) {
          sum += weights[static_cast<std::size_t>(k)] * (part.at(i - k, j) + part.at(i + k, j));
        }
      }
      turned.at(j, i) = sum;
    }
  }
  return turned;
}

}  // namespace

Heights::Heights(const Vec2& size, double margin, double spacing) : step(spacing) {
  const int around = static_cast<int>(std::ceil(margin / step));
  origin = Vec2::Constant(-around * step);
  columns = static_cast<int>(std::lround(size.x() / step)) + 2 * around + 1;
  rows = static_cast<int>(std::lround(size.y() / step)) + 2 * around + 1;
  z.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0.0);
}

void mill(const std::string& program, double radius, Heights& blank) {
  std::ifstream file(program);
  if (!file) throw std::runtime_error(program + ": cannot be read");
  Vec3 at(HUGE_VAL, HUGE_VAL, HUGE_VAL);
  int motion = 0;
  int plane = 17;
  int number = 0;
  for (std::string text; std::getline(file, text);) {
    ++number;
    const std::string words = words_of(text);
    Vec3 to = at;
    Vec3 centre = at;
    bool moves = false;
    for (std::size_t k = 0; k < words.size();) {
      const char letter = words[k];
      char* end = nullptr;
      const double value = std::strtod(words.c_str() + k + 1, &end);
      k = static_cast<std::size_t>(end - words.c_str());
      if (letter == 'G' && value >= 0.0 && value <= 3.0) motion = static_cast<int>(value);
      if (letter == 'G' && value >= 17.0 && value <= 19.0) plane = static_cast<int>(value);
      if (letter == 'G' && (value == 20.0 || value == 91.0)) refuse(program, number, words);
      if (letter >= 'I' && letter <= 'K') centre[letter - 'I'] += value;
      if (letter < 'X' || letter > 'Z') continue;
      to[letter - 'X'] = value;
      moves = true;
    }
    const Vec3 up(0.0, 0.0, radius);
    if (moves && motion > 0 && !(at.allFinite() && to.allFinite())) {
      refuse(program, number, "a cut from an unknown place");
    }
    if (moves && motion == 1) cut({at + up, to + up, radius}, blank);
    if (moves && motion > 1 && plane == 17) refuse(program, number, "a level arc");
    if (moves && motion > 1) {
      cut_arc(at + up, to + up, centre + up, plane == 18 ? 0 : 1, radius, blank);
    }
    at = to;
  }
}

void polish(double sigma, Heights& part) {
  const std::vector<double> weights = gaussian(sigma, part.step);
  part = averaged(averaged(part, weights), weights);
}

}  // namespace tracer
