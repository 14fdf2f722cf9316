// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/spline/spline_nodes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/lens/continued_surface.h"
#include "core/optics/polish_transfer.h"
#include "core/spline/control_net.h"

namespace lensforge {
namespace {

/// Radius of the Gaussian, in σ, as in PolishedField.
constexpr double kGaussianReach = 5.0;

/// Points per σ of the sum that replaces its integral.
constexpr int kPointsPerSigma = 32;

/// A point of a sum that replaces an integral over a Gaussian: weights of the surface there in its
/// average and in the average's derivatives.
struct SumPoint {
  double at = 0.0;
  double weight = 0.0;
  double first = 0.0;
  double second = 0.0;
  double third = 0.0;
};

/// Derivatives are those of the Gaussian, G′ = −s/v G, G″ = (s²/v − 1)/v G, G‴ = (κ − s²/v) s/v² G
/// with its variance v and κ = 3, both as computed from the points: so derivatives of a straight
/// line are exact.
std::vector<SumPoint> gaussian_points(double sigma) {
  const int count = static_cast<int>(kGaussianReach * kPointsPerSigma);
  std::vector<SumPoint> points;
  double total = 0.0;
  for (int i = -count; i <= count; ++i) {
    const double t = static_cast<double>(i) / kPointsPerSigma;
    SumPoint& p = points.emplace_back();
    p.at = t * sigma;
    p.weight = std::exp(-0.5 * t * t);
    total += p.weight;
  }
  double v = 0.0;
  double fourth = 0.0;
  for (SumPoint& p : points) {
    p.weight /= total;
    v += p.weight * p.at * p.at;
    fourth += p.weight * std::pow(p.at, 4);
  }
  for (SumPoint& p : points) {
    const double square = p.at * p.at / v;
    p.first = -p.at / v * p.weight;
    p.second = (square - 1.0) / v * p.weight;
    p.third = (fourth / (v * v) - square) * p.at / (v * v) * p.weight;
  }
  return points;
}

/// Points of a film's term and its derivatives.
std::vector<SumPoint> film_points(const LineTerm& term, double sigma) {
  const int count = static_cast<int>(kFilmReach * kPointsPerSigma);
  std::vector<SumPoint> points;
  for (int i = -count; i <= count; ++i) {
    const double t = static_cast<double>(i) / kPointsPerSigma;
    const double weight = 1.0 / kPointsPerSigma;
    points.push_back({t * sigma, weight * term.kernel(t, 0), weight / sigma * term.kernel(t, 1),
                      weight / (sigma * sigma) * term.kernel(t, 2),
                      weight / std::pow(sigma, 3) * term.kernel(t, 3)});
  }
  return points;
}

/// Makes a film's terms exact for constants, and their slopes for straight lines.
void straighten(std::vector<std::vector<SumPoint>>& terms) {
  double mean = 0.0;
  double rise = 0.0;
  for (std::size_t n = 0; n < terms.size(); ++n) {
    double of_term = 0.0;
    double rise_of_term = 0.0;
    for (const SumPoint& p : terms[n]) {
      of_term += p.weight;
      rise_of_term -= p.first * p.at;
    }
    mean += film_terms()[n].sign * of_term * of_term;
    rise += film_terms()[n].sign * of_term * rise_of_term;
  }
  const double by_mean = 1.0 / std::sqrt(mean);
  const double by_rise = std::sqrt(mean) / rise;
  for (std::vector<SumPoint>& term : terms) {
    for (SumPoint& p : term) {
      p.weight *= by_mean;
      p.first *= by_rise;
      p.second *= by_mean;
      p.third *= by_rise;
    }
  }
}

/// One node as a sum over all coefficients.
class NodeSum {
 public:
  /// @param cell  length of a knot cell, mm.
  NodeSum(int cells, double cell)
      : cells_(cells),
        cell_(cell),
        value_(static_cast<std::size_t>(cells) + 3),
        slope_(value_.size()) {}

  /// Adds `value` times the surface at t to the node's value and `slope` times it to its slope;
  /// beyond its ends the surface goes on as continued_surface() does.
  void add(double t, double value, double slope) {
    const double inside = std::clamp(t, 0.0, static_cast<double>(cells_));
    const double beyond = t - inside;
    const double bent = RunOut{}.height(std::abs(beyond) * cell_) / (cell_ * cell_);
    const CubicBasis b = cubic_basis(inside, cells_);
    for (std::size_t j = 0; j < b.value.size(); ++j) {
      const std::size_t i = static_cast<std::size_t>(b.first) + j;
      const double height = b.value[j] + beyond * b.slope[j] + bent * b.bend[j];
      value_[i] += value * height;
      slope_[i] += slope * height;
    }
  }

  [[nodiscard]] const std::vector<double>& value() const { return value_; }
  [[nodiscard]] const std::vector<double>& slope() const { return slope_; }

 private:
  int cells_;
  double cell_;
  std::vector<double> value_;
  std::vector<double> slope_;
};

/// Appends the entries of one node within its window of coefficients.
void append(const NodeSum& sum, int first, AxisBasis& basis) {
  basis.first.push_back(first);
  for (int j = 0; j < basis.taps; ++j) {
    const int coefficient = first + j;
    const auto i = static_cast<std::size_t>(coefficient);
    basis.value.push_back(sum.value()[i]);
    basis.slope.push_back(sum.slope()[i]);
  }
}

/// Adds the four functions of the spline itself at t to the node that was appended last.
void append_plan(double t, AxisBasis& basis) {
  const CubicBasis at = cubic_basis(t, basis.coefficients - 3);
  basis.plan_value.resize(basis.value.size());
  basis.plan_slope.resize(basis.slope.size());
  const auto window = static_cast<std::ptrdiff_t>(basis.value.size()) - basis.taps;
  const std::ptrdiff_t to = window + at.first - basis.first.back();
  std::copy(at.value.begin(), at.value.end(), basis.plan_value.begin() + to);
  std::copy(at.slope.begin(), at.slope.end(), basis.plan_slope.begin() + to);
}

}  // namespace

std::vector<double> even_points(int cells, int samples) {
  std::vector<double> points;
  for (int k = 0; k <= cells * samples; ++k) points.push_back(static_cast<double>(k) / samples);
  return points;
}

AxisBasis plain_basis(int cells, const std::vector<double>& points) {
  AxisBasis basis;
  basis.coefficients = cells + 3;
  basis.taps = 4;
  for (const double t : points) {
    const CubicBasis at = cubic_basis(t, cells);
    basis.first.push_back(at.first);
    basis.value.insert(basis.value.end(), at.value.begin(), at.value.end());
    basis.slope.insert(basis.slope.end(), at.slope.begin(), at.slope.end());
  }
  basis.plan_value = basis.value;
  basis.plan_slope = basis.slope;
  basis.lift.resize(points.size());
  basis.tilt.resize(points.size());
  return basis;
}

namespace {

/// The spline averaged with these points, in knot cells.
AxisBasis averaged_basis(const AxisLength& along, const std::vector<double>& points,
                         const MadeBy& made, const std::vector<SumPoint>& sum_points) {
  const double cell = along.length / along.cells;
  const bool across = made.rows_along_x == (along.axis == 1);
  const double bend = across ? std::pow(made.pitch / cell, 2) / 24.0 : 0.0;
  const int reach = static_cast<int>(std::ceil(sum_points.back().at));
  AxisBasis basis;
  basis.coefficients = along.cells + 3;
  basis.taps = std::min(basis.coefficients, 2 * reach + 4);
  for (const double t : points) {
    NodeSum sum(along.cells, cell);
    for (const SumPoint& g : sum_points) {
      sum.add(t - g.at, g.weight + bend * g.second, g.first + bend * g.third);
    }
    const int here = std::min(static_cast<int>(t), along.cells - 1);
    append(sum, std::clamp(here - reach, 0, basis.coefficients - basis.taps), basis);
    append_plan(t, basis);
    const double low = made.rim_depth * std::exp(-t * cell / made.rim_length);
    const double high = made.rim_depth * std::exp((t * cell - along.length) / made.rim_length);
    basis.lift.push_back(-low - high);
    basis.tilt.push_back((low - high) * cell / made.rim_length);
  }
  return basis;
}

void weigh(AxisBasis& basis, double weight) {
  for (double& value : basis.value) value *= weight;
  for (double& slope : basis.slope) slope *= weight;
}

}  // namespace

/// Weights of the terms are in the bases along y.
std::vector<AxisBasis> made_bases(const AxisLength& along, const std::vector<double>& points,
                                  const MadeBy& made) {
  const double sigma = made.polish_sigma * along.cells / along.length;
  std::vector<AxisBasis> bases;
  if (made.polish_order == kFilmOrder) {
    std::vector<std::vector<SumPoint>> terms;
    for (const LineTerm& term : film_terms()) terms.push_back(film_points(term, sigma));
    straighten(terms);
    for (std::size_t n = 0; n < terms.size(); ++n) {
      bases.push_back(averaged_basis(along, points, made, terms[n]));
      if (along.axis == 1) weigh(bases.back(), film_terms()[n].sign);
    }
  } else {
    bases.push_back(averaged_basis(along, points, made, gaussian_points(sigma)));
  }
  if (made.polish_floor == 0.0) return bases;
  bases.push_back(plain_basis(along.cells, points));
  if (along.axis == 0) return bases;
  for (AxisBasis& basis : bases) weigh(basis, 1.0 - made.polish_floor);
  bases.back() = plain_basis(along.cells, points);
  weigh(bases.back(), made.polish_floor);
  return bases;
}

AxisBasis made_basis(const AxisLength& along, const std::vector<double>& points,
                     const MadeBy& made) {
  return made_bases(along, points, made).front();
}

namespace {

template <class Kernel>
void call_along_rows(const Executor& executor, const char* name, std::int64_t count,
                     const Kernel& kernel, Lanes lanes) {
  const std::int64_t columns = kernel.s.nodes_u;
  const auto call_row = [&](std::int64_t row) {
    call_with_lanes(lanes, [&]<int kLanes>() {
      const std::int64_t end = (row + 1) * columns;
      std::int64_t i = row * columns;
      for (; i + kLanes <= end; i += kLanes) {
        kernel.template call<typename VectorOf<kLanes>::Doubles>(i);
      }
      for (; i < end; ++i) kernel(i);
    });
  };
  parallel_for(executor, name, count / columns, call_row,
               std::max<std::int64_t>(1, kDefaultGrain / columns));
}

}  // namespace

void call_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                   const LookAcrossRows& look, Lanes lanes) {
  call_along_rows(executor, kernel, count, look, lanes);
}

void call_in_lanes(const Executor& executor, const char* kernel, std::int64_t count,
                   const GatherAcrossRows& gather, Lanes lanes) {
  call_along_rows(executor, kernel, count, gather, lanes);
}

}  // namespace lensforge
