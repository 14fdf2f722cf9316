// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "cam/coupon/least_squares.h"
#include "cam/coupon/reading_model.h"
#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

enum Parameter { kSigma, kRadius, kPitchError, kOffset, kParameters };

// σ from which the search begins: beyond them no ripple is changed, or none is left.
constexpr double kLeastSigma = 0.002;  ///< mm
constexpr double kMostSigma = 0.3;     ///< mm
constexpr double kNoSigma = 1e-6;      ///< mm; in place of 0, which has no logarithm.
constexpr int kSigmas = 161;           ///< In equal ratios of 1.03.
constexpr std::size_t kStarts = 4;     ///< Of them, as many are followed to their minimum.

CouponState state_of(const Eigen::VectorXd& p) {
  return {std::exp(p[kSigma]), std::exp(p[kRadius]), p[kPitchError], p[kOffset]};
}

Eigen::VectorXd parameters_of(const CouponState& state) {
  return Eigen::Vector4d(std::log(std::max(state.sigma, kNoSigma)), std::log(state.radius),
                         state.pitch_error, state.groove_offset);
}

/// Deviations of readings from a state, in their uncertainties.
LeastSquares problem_of(const std::vector<ModelledReading>& readings) {
  LeastSquares problem;
  problem.steps = Eigen::Vector4d(1e-4, 1e-5, 1e-6, 1e-6);
  problem.longest = Eigen::Vector4d(0.5, 0.2, 0.01, 0.02);
  problem.residuals = [&readings](const Eigen::VectorXd& p) {
    const CouponState state = state_of(p);
    Eigen::VectorXd residuals(static_cast<Eigen::Index>(readings.size()));
    for (std::size_t i = 0; i < readings.size(); ++i) {
      const Reading& reading = readings[i].reading;
      residuals[static_cast<Eigen::Index>(i)] =
          (readings[i].predicted(state) - reading.value) / reading.uncertainty;
    }
    return residuals;
  };
  return problem;
}

/// Values of σ where the readings agree better than for its neighbours.
std::vector<Eigen::VectorXd> starts(const LeastSquares& problem, const Eigen::VectorXd& begin) {
  if (std::find(problem.free.begin(), problem.free.end(), kSigma) == problem.free.end()) {
    return {begin};
  }
  std::vector<Eigen::VectorXd> places(kSigmas, begin);
  std::vector<double> sums;
  for (int k = 0; k < kSigmas; ++k) {
    const double share = k / (kSigmas - 1.0);
    places[static_cast<std::size_t>(k)][kSigma] =
        std::log(kLeastSigma) + share * std::log(kMostSigma / kLeastSigma);
    sums.push_back(problem.residuals(places[static_cast<std::size_t>(k)]).squaredNorm());
  }
  std::vector<std::pair<double, std::size_t>> lowest;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const bool below_left = k == 0 || sums[k] <= sums[k - 1];
    const bool below_right = k + 1 == places.size() || sums[k] < sums[k + 1];
    if (below_left && below_right) lowest.emplace_back(sums[k], k);
  }
  std::sort(lowest.begin(), lowest.end());
  lowest.resize(std::min(lowest.size(), kStarts));
  std::vector<Eigen::VectorXd> chosen{begin};
  for (const auto& [sum, k] : lowest) chosen.push_back(places[k]);
  return chosen;
}

Eigen::VectorXd best_fit(const LeastSquares& problem, const Eigen::VectorXd& begin) {
  Eigen::VectorXd best = begin;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::VectorXd& start : starts(problem, begin)) {
    const Eigen::VectorXd end = minimize(problem, start);
    const double sum = problem.residuals(end).squaredNorm();
    if (sum < least) {
      least = sum;
      best = end;
    }
  }
  return best;
}

/// The parameters that readings of these kinds say anything of.
std::vector<int> touched(const CouponReadings& readings) {
  const auto any = [](const auto& entries, auto... kinds) {
    return std::any_of(entries.begin(), entries.end(),
                       [&](const auto& entry) { return ((entry.*kinds).has_value() || ...); });
  };
  const bool polished = any(readings.pads, &PadReadings::after, &PadReadings::orders);
  const bool grooves = any(readings.grooves, &GrooveReadings::width);
  std::vector<int> free;
  if (polished) free.push_back(kSigma);
  if (polished || grooves || any(readings.pads, &PadReadings::before)) free.push_back(kRadius);
  if (any(readings.marks, &MarkReadings::distance)) free.push_back(kPitchError);
  if (grooves) free.push_back(kOffset);
  return free;
}

/// A problem with its minimum.
struct Solution {
  LeastSquares problem;
  Eigen::VectorXd best;
  FitQuality quality;

  /// Place of a parameter among those that are free; none where it is held.
  [[nodiscard]] std::optional<Eigen::Index> place(int parameter) const {
    const auto at = std::find(problem.free.begin(), problem.free.end(), parameter);
    if (at == problem.free.end()) return std::nullopt;
    return at - problem.free.begin();
  }
  void solve(const CouponState& own) {
    best = best_fit(problem, parameters_of(own));
    quality = fit_quality(problem, best);
  }
};

/// Which parameter has to be held, −1 for none. The radius first: it has a maker, who states it.
int unknown_among(const Solution& solution) {
  const std::array limits{std::pair(kRadius, kRadiusShare), std::pair(kSigma, kSigmaShare),
                          std::pair(kPitchError, kPitchErrorMost)};
  for (const auto& [parameter, most] : limits) {
    const auto place = solution.place(parameter);
    if (place && !(solution.quality.uncertainties[*place] <= most)) return parameter;
  }
  return -1;
}

/// A ball that is held may be off by kRadiusShare, which goes into the uncertainty of ln σ.
void take_in_ball(Solution& solution) {
  constexpr double kChange = 0.01;
  const auto sigma = solution.place(kSigma);
  if (solution.place(kRadius) || !sigma) return;
  Eigen::VectorXd other = solution.best;
  other[kRadius] += kChange;
  const double change = minimize(solution.problem, other)[kSigma] - solution.best[kSigma];
  double& known = solution.quality.uncertainties[*sigma];
  known = std::hypot(known, kRadiusShare / kChange * change);
}

/// @throw InputError naming the reading that is farthest from what the others say, if it is farther
///        than kMostDeviation; and any that is as far.
void require_agreement(const std::vector<ModelledReading>& readings, const FitQuality& quality,
                       const std::string& file) {
  constexpr double kAsFar = 0.95;
  const Eigen::VectorXd far = quality.deletion.cwiseAbs();
  Eigen::Index worst = 0;
  if (far.maxCoeff(&worst) <= kMostDeviation) return;
  const ModelledReading& one = readings[static_cast<std::size_t>(worst)];
  std::string others;
  for (Eigen::Index i = 0; i < far.size(); ++i) {
    if (i == worst || far[i] < kAsFar * far[worst]) continue;
    others += (others.empty() ? "" : ", ") + readings[static_cast<std::size_t>(i)].key;
  }
  throw InputError(
      file + ": " + one.key + ": " + number_text(one.reading.value / one.unit) + ": is " +
      decimal_text(far[worst], 1) + " standard deviations off what the other readings say" +
      (others.empty() ? "" : ", as far as " + others) + ": measure it again or take it out");
}

/// To between a hundredth and a thousandth of its uncertainty, so that files can be read.
double to_digits(double value, double uncertainty) {
  const double digits = std::pow(10.0, 2.0 - std::floor(std::log10(uncertainty)));
  return std::round(value * digits) / digits;
}

/// @param unit  of the value for one of the parameter's.
FittedValue value_of(const Solution& solution, Parameter parameter, double unit,
                     FittedValue workshops, double fitted) {
  const auto place = solution.place(parameter);
  if (!place) return workshops;
  const double uncertainty = unit * solution.quality.uncertainties[*place];
  return {workshops.key, to_digits(fitted, uncertainty), uncertainty, true};
}

CouponFit result_of(const std::vector<ModelledReading>& readings, const CouponState& own,
                    const Solution& solution) {
  CouponFit fit;
  const CouponState state = state_of(solution.best);
  const double diameter = 2.0 * state.radius;
  fit.sigma = value_of(solution, kSigma, state.sigma, {"polish.sigma", own.sigma}, state.sigma);
  fit.diameter =
      value_of(solution, kRadius, diameter, {"tool.diameter", 2.0 * own.radius}, diameter);
  fit.pitch_error = value_of(solution, kPitchError, 1.0, {"finish.pitch_error", own.pitch_error},
                             state.pitch_error);
  fit.touch_off =
      value_of(solution, kOffset, 1.0, {"touch-off (mm)", own.groove_offset}, state.groove_offset);
  const Eigen::VectorXd residuals = solution.problem.residuals(solution.best);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const ModelledReading& one = readings[i];
    fit.readings.push_back({one.key, one.reading.value / one.unit, one.predicted(state) / one.unit,
                            -residuals[static_cast<Eigen::Index>(i)]});
  }
  fit.chi_square = residuals.squaredNorm();
  fit.freedom = static_cast<int>(readings.size()) - static_cast<int>(solution.problem.free.size());
  return fit;
}

}  // namespace

Workshop CouponFit::applied_to(Workshop workshop) const {
  if (sigma.determined) workshop.polish.sigma = sigma.value;
  if (pitch_error.determined) workshop.process.finish.pitch_error = pitch_error.value;
  for (Tool& tool : workshop.tools) {
    if (diameter.determined && tool.number == workshop.process.finish.tool) {
      tool.diameter = diameter.value;
    }
  }
  return workshop;
}

CouponFit fit_coupon(const CouponReadings& readings, const Workshop& workshop,
                     const std::string& file) {
  const std::vector<ModelledReading> modelled = modelled_readings(readings);
  if (modelled.empty()) {
    throw InputError(file + ": 0 readings: fill in at least one, and take the # away before it");
  }
  const CouponState own = CouponState::of(workshop);
  require_plausible(modelled, own, file);
  Solution solution{problem_of(modelled), {}, {}};
  solution.problem.free = touched(readings);
  solution.solve(own);
  for (int held = unknown_among(solution); held >= 0; held = unknown_among(solution)) {
    std::erase(solution.problem.free, held);
    solution.solve(own);
  }
  require_agreement(modelled, solution.quality, file);
  take_in_ball(solution);
  return result_of(modelled, own, solution);
}

CouponFit expected_fit(const CouponReadings& expected, const Workshop& workshop) {
  return fit_coupon(expected, workshop, "expected readings");
}

}  // namespace lensforge
