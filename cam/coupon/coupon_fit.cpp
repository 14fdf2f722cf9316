// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon_fit.h"

#include <toml++/toml.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cam/coupon/coupon.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/optics/polish_transfer.h"
#include "core/schema/toml.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

constexpr int kMaxSteps = 200;
constexpr double kFirstDamping = 1e-3;
constexpr double kMaxDamping = 1e10;  ///< Steps are then shorter than the differences.
constexpr double kEasing = 10.0;

/// Minimum significant eigenvalue of JᵀJ with columns scaled to length 1: differences are exact to
/// about 1e-8.
constexpr double kSingular = 1e-12;

/// 1 − h of a datum that alone determines a parameter: the others do not determine it.
constexpr double kAlone = 1e-6;

struct Normal {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd scale;    ///< Lengths of the jacobian's columns, 1 for columns of zeros.
  Eigen::MatrixXd inverse;  ///< Of JᵀJ.
};

Normal normal_of(const LeastSquares& problem, const Eigen::VectorXd& parameters) {
  Normal normal;
  normal.jacobian = problem.jacobian(parameters);
  normal.scale = normal.jacobian.colwise().norm().transpose();
  for (double& length : normal.scale) length = length > 0.0 ? length : 1.0;
  const Eigen::MatrixXd unit = normal.jacobian * normal.scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(unit.transpose() * unit);
  const Eigen::VectorXd values = solver.eigenvalues().cwiseMax(kSingular);
  const Eigen::MatrixXd half = normal.scale.cwiseInverse().asDiagonal() * solver.eigenvectors() *
                               values.cwiseSqrt().cwiseInverse().asDiagonal();
  normal.inverse = half * half.transpose();
  return normal;
}

/// A damped step within its maximum length.
Eigen::VectorXd step_of(const LeastSquares& problem, const Eigen::MatrixXd& jacobian,
                        const Eigen::VectorXd& residuals, double damping) {
  Eigen::MatrixXd matrix = jacobian.transpose() * jacobian;
  const double floor = kSingular * std::max(matrix.diagonal().maxCoeff(), 1e-300);
  matrix.diagonal() += damping * matrix.diagonal().cwiseMax(floor);
  Eigen::VectorXd step = -matrix.ldlt().solve(jacobian.transpose() * residuals);
  double longest = 1.0;
  for (Eigen::Index i = 0; i < step.size(); ++i) {
    longest = std::max(
        longest, std::abs(step[i]) / problem.longest[problem.free[static_cast<std::size_t>(i)]]);
  }
  return step / longest;
}

}  // namespace

Eigen::MatrixXd LeastSquares::jacobian(const Eigen::VectorXd& parameters) const {
  if (derivatives) return derivatives(parameters)(Eigen::all, free);
  Eigen::MatrixXd columns;
  for (std::size_t i = 0; i < free.size(); ++i) {
    Eigen::VectorXd moved = parameters;
    const double step = steps[free[i]];
    moved[free[i]] = parameters[free[i]] + step;
    const Eigen::VectorXd above = residuals(moved);
    moved[free[i]] = parameters[free[i]] - step;
    const Eigen::VectorXd below = residuals(moved);
    columns.conservativeResize(above.size(), static_cast<Eigen::Index>(free.size()));
    columns.col(static_cast<Eigen::Index>(i)) = (above - below) / (2.0 * step);
  }
  return columns;
}

Eigen::VectorXd minimize(const LeastSquares& problem, Eigen::VectorXd start) {
  if (problem.free.empty()) return start;
  Eigen::VectorXd at = std::move(start);
  Eigen::VectorXd residuals = problem.residuals(at);
  double damping = kFirstDamping;
  for (int k = 0; k < kMaxSteps && damping < kMaxDamping; ++k) {
    const Eigen::MatrixXd jacobian = problem.jacobian(at);
    const double before = residuals.squaredNorm();
    for (; damping < kMaxDamping; damping *= kEasing) {
      const Eigen::VectorXd step = step_of(problem, jacobian, residuals, damping);
      Eigen::VectorXd tried = at;
      for (std::size_t i = 0; i < problem.free.size(); ++i) {
        tried[problem.free[i]] += step[static_cast<Eigen::Index>(i)];
      }
      const Eigen::VectorXd now = problem.residuals(tried);
      if (!(now.squaredNorm() < before)) continue;
      at = tried;
      residuals = now;
      damping /= kEasing;
      break;
    }
    if (before - residuals.squaredNorm() <= problem.least_gain * before) break;
  }
  return at;
}

FitQuality fit_quality(const LeastSquares& problem, const Eigen::VectorXd& minimum) {
  const Eigen::VectorXd residuals = problem.residuals(minimum);
  if (problem.free.empty()) return {{}, residuals};
  const Normal normal = normal_of(problem, minimum);
  FitQuality quality;
  quality.uncertainties = normal.inverse.diagonal().cwiseSqrt();
  quality.deletion = residuals;
  for (Eigen::Index i = 0; i < residuals.size(); ++i) {
    const Eigen::RowVectorXd row = normal.jacobian.row(i);
    const double rest = 1.0 - row * normal.inverse * row.transpose();
    quality.deletion[i] = rest > kAlone ? residuals[i] / std::sqrt(rest) : 0.0;
  }
  return quality;
}

namespace {

/// One reading and its prediction from a coupon's state.
struct ModelledReading {
  std::string key;    ///< "groove[2].width_mm (G3)"
  double unit = 1.0;  ///< Of the key: 1e-3 mm for a height in µm.
  Reading reading;    ///< mm, or a share.
  std::function<double(const CouponState&)> predicted;
  double least = 0.0;  ///< Range of reading ÷ usual value; outside, the reading is implausible.
  double most = 0.0;
  bool polished = false;  ///< The usual value is the unpolished one, which is the maximum.
};

constexpr double kMicrometre = 1e-3;  ///< mm

// Plausible ranges of readings, as shares of the expected value. Marks: the largest pitch error of
// a workshop and a reading's own. Widths and heights: a ball of half or twice its size; a wrong
// unit is off by a thousand. After polishing any small value is plausible, and any light is:
// parse_readings() knows the most haze that there can be.
constexpr double kMarkShare = 0.03;
constexpr double kFactor = 3.0;
constexpr double kAnyFactor = std::numeric_limits<double>::max();

/// With the feature's name on the coupon: "groove[2].width_mm (G3)".
std::string key_of(const char* array, std::size_t index, const char* key) {
  std::string entry = std::string(array) + "[" + std::to_string(index) + "]." + key;
  if (entry.starts_with("mark")) return entry;
  if (entry.starts_with("haze")) return entry += std::string(" (") + kFlatName + ")";
  return entry += " (" + feature_name(entry.starts_with("groove") ? 'G' : 'P', index) + ")";
}

/// Every reading that was taken.
std::vector<ModelledReading> modelled_readings(const CouponReadings& readings) {
  using State = CouponState;
  std::vector<ModelledReading> all;
  const auto add = [&](const std::optional<Reading>& reading, const ModelledReading& model) {
    if (!reading) return;
    all.push_back(model);
    all.back().reading = *reading;
  };
  for (std::size_t i = 0; i < readings.marks.size(); ++i) {
    const auto predicted = [mm = readings.marks[i].programmed](const State& s) {
      return s.mark_distance(mm);
    };
    add(readings.marks[i].distance,
        {key_of("mark", i, "distance_mm"), 1.0, {}, predicted, 1.0 - kMarkShare, 1.0 + kMarkShare});
  }
  for (std::size_t i = 0; i < readings.grooves.size(); ++i) {
    const auto predicted = [mm = readings.grooves[i].depth](const State& s) {
      return s.groove_width(mm);
    };
    add(readings.grooves[i].width,
        {key_of("groove", i, "width_mm"), 1.0, {}, predicted, 1.0 / kFactor, kFactor});
  }
  for (std::size_t i = 0; i < readings.pads.size(); ++i) {
    const PadReadings& pad = readings.pads[i];
    const auto before = [mm = pad.pitch](const State& s) { return s.scallop_before(mm); };
    const auto after = [mm = pad.pitch](const State& s) { return s.scallop_after(mm); };
    const auto orders = [mm = pad.pitch, light = readings.light](const State& s) {
      return s.order_ratio(mm, light);
    };
    add(pad.before,
        {key_of("pad", i, "before_um"), kMicrometre, {}, before, 1.0 / kFactor, kFactor});
    add(pad.after, {key_of("pad", i, "after_um"), kMicrometre, {}, after, 0.0, kFactor, true});
    add(pad.orders, {key_of("pad", i, "order_ratio"), 1.0, {}, orders, 0.0, kAnyFactor});
  }
  for (std::size_t i = 0; i < readings.haze.size(); ++i) {
    const auto haze = [place = readings.haze[i].place, light = readings.light](const State& s) {
      return s.haze_ratio(place, light);
    };
    add(readings.haze[i].ratio, {key_of("haze", i, "light_ratio"), 1.0, {}, haze, 0.0, kAnyFactor});
  }
  return all;
}

/// @throw InputError naming file, key, value and rule for a reading impossible for a coupon of such
///        a workshop.
void require_plausible(const std::vector<ModelledReading>& readings, const CouponState& expected,
                       const std::string& file) {
  CouponState unpolished = expected;
  unpolished.sigma = 0.0;
  for (const ModelledReading& one : readings) {
    if (one.most == kAnyFactor) continue;
    const double usual = one.predicted(one.polished ? unpolished : expected) / one.unit;
    const double value = one.reading.value / one.unit;
    if (value >= one.least * usual && value <= one.most * usual) continue;
    throw InputError(file + ": " + one.key + ": " + number_text(value) + ": must be in " +
                     number_text(one.least * usual, 4) + " to " + number_text(one.most * usual, 4) +
                     ", since the workshop's " + (one.polished ? "ball leaves " : "values give ") +
                     number_text(usual, 4) + (one.polished ? " before polishing" : "") +
                     "; the key names the unit");
  }
}

enum Parameter { kSigma, kRadius, kPitchError, kOffset, kFloor, kRoughness, kCorrelation };

// Range of σ for the search: outside it no ripple is changed, or none is left.
constexpr double kMinSigma = 0.002;  ///< mm
constexpr double kMaxSigma = 0.3;    ///< mm
constexpr double kNoSigma = 1e-6;    ///< mm; in place of 0, which has no logarithm.
constexpr int kSigmas = 161;         ///< In equal ratios of 1.03.
constexpr std::size_t kStarts = 4;   ///< Number of them followed to their minimum.

constexpr double kNoRoughness = 1e-3;  ///< nm; in place of 0, too.

using Parameters = Eigen::Vector<double, 7>;

CouponState state_of(const Eigen::VectorXd& p, int order) {
  return {std::exp(p[kSigma]),
          std::exp(p[kRadius]),
          p[kPitchError],
          p[kOffset],
          p[kFloor],
          order,
          {std::exp(p[kRoughness]), std::exp(p[kCorrelation])}};
}

Eigen::VectorXd parameters_of(const CouponState& state) {
  return Parameters{{std::log(std::max(state.sigma, kNoSigma)), std::log(state.radius),
                     state.pitch_error, state.groove_offset, state.floor,
                     std::log(std::max(state.roughness.rms, kNoRoughness)),
                     std::log(state.roughness.correlation)}};
}

bool contains(const std::vector<int>& free, int parameter) {
  return std::find(free.begin(), free.end(), parameter) != free.end();
}

/// Deviations of readings from a state, in their uncertainties.
LeastSquares problem_of(const std::vector<ModelledReading>& readings, int order) {
  LeastSquares problem;
  problem.steps = Parameters{{1e-4, 1e-5, 1e-6, 1e-6, 1e-5, 1e-5, 1e-5}};
  problem.longest = Parameters{{0.5, 0.2, 0.01, 0.02, 0.05, 0.5, 0.2}};
  problem.residuals = [&readings, order](const Eigen::VectorXd& p) {
    const CouponState state = state_of(p, order);
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

/// Values of σ where the readings agree better than at its neighbours.
std::vector<Eigen::VectorXd> starts(const LeastSquares& problem, const Eigen::VectorXd& begin) {
  if (!contains(problem.free, kSigma)) return {begin};
  std::vector<Eigen::VectorXd> places(kSigmas, begin);
  std::vector<double> sums;
  for (int k = 0; k < kSigmas; ++k) {
    const double share = k / (kSigmas - 1.0);
    places[static_cast<std::size_t>(k)][kSigma] =
        std::log(kMinSigma) + share * std::log(kMaxSigma / kMinSigma);
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

// Correlation lengths for the search: the light's width goes with 1/ℓ, and from one that is 1.5
// times too long or too short the steps find their way.
constexpr double kMinCorrelation = 0.3;    ///< µm; shorter than a wave of light.
constexpr double kMaxCorrelation = 100.0;  ///< µm; the light stays in the beam.
constexpr double kCorrelationRatio = 1.5;
constexpr double kRoughnessStart = 10.0;  ///< nm

/// The values of the workshop, but for a roughness that is fitted: where the haze agrees best of
/// several correlation lengths, each with its own σ_r.
Eigen::VectorXd begin_of(const LeastSquares& problem, const CouponState& own) {
  Eigen::VectorXd best = parameters_of(own);
  if (contains(problem.free, kRoughness)) best[kRoughness] = std::log(kRoughnessStart);
  if (!contains(problem.free, kCorrelation)) return best;
  LeastSquares alone = problem;
  alone.free = {kRoughness};
  double least = std::numeric_limits<double>::infinity();
  Eigen::VectorXd start = best;
  for (double length = kMinCorrelation; length < kMaxCorrelation; length *= kCorrelationRatio) {
    start[kCorrelation] = std::log(length);
    const Eigen::VectorXd end = minimize(alone, start);
    const double sum = problem.residuals(end).squaredNorm();
    if (sum >= least) continue;
    least = sum;
    best = end;
  }
  return best;
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

/// The parameters on which readings of these kinds depend.
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
  if (any(readings.haze, &HazeReadings::ratio)) {
    free.push_back(kRoughness);
    free.push_back(kCorrelation);
  }
  return free;
}

/// A problem with its minimum.
struct Solution {
  int order = kPadOrder;
  LeastSquares problem;
  Eigen::VectorXd best;
  FitQuality quality;
  double chi_square = 0.0;

  /// Index of a parameter among the free ones; none where it is held.
  [[nodiscard]] std::optional<Eigen::Index> place(int parameter) const {
    const auto at = std::find(problem.free.begin(), problem.free.end(), parameter);
    if (at == problem.free.end()) return std::nullopt;
    return at - problem.free.begin();
  }
  void solve(const CouponState& own) { settle(best_fit(problem, begin_of(problem, own))); }
  void settle(const Eigen::VectorXd& minimum) {
    best = minimum;
    quality = fit_quality(problem, best);
    chi_square = problem.residuals(best).squaredNorm();
  }
};

/// Parameter to be held, −1 for none. The radius first: its maker states it. The roughness last:
/// its light alone gives it for a known correlation length.
int unknown_among(const Solution& solution) {
  const std::array limits{std::pair(kRadius, kRadiusShare), std::pair(kSigma, kSigmaShare),
                          std::pair(kPitchError, kPitchErrorMost),
                          std::pair(kCorrelation, kCorrelationShare),
                          std::pair(kRoughness, kRoughnessShare)};
  for (const auto& [parameter, most] : limits) {
    const auto place = solution.place(parameter);
    if (place && !(solution.quality.uncertainties[*place] <= most)) return parameter;
  }
  return -1;
}

/// Adds an error `share` of a held value to the uncertainty of a fitted one, both logarithms.
void take_in(Solution& solution, Parameter held, double share, Parameter fitted) {
  constexpr double kChange = 0.01;
  const auto place = solution.place(fitted);
  if (solution.place(held) || !place) return;
  Eigen::VectorXd other = solution.best;
  other[held] += kChange;
  const double change = minimize(solution.problem, other)[fitted] - solution.best[fitted];
  double& known = solution.quality.uncertainties[*place];
  known = std::hypot(known, share / kChange * change);
}

/// @throw InputError naming the reading that deviates most from the others, if by more than
///        kMaxDeviation, and any with an equal deviation.
void require_agreement(const std::vector<ModelledReading>& readings, const FitQuality& quality,
                       const std::string& file) {
  constexpr double kAsFar = 0.95;
  const Eigen::VectorXd far = quality.deletion.cwiseAbs();
  Eigen::Index worst = 0;
  if (far.maxCoeff(&worst) <= kMaxDeviation) return;
  const ModelledReading& one = readings[static_cast<std::size_t>(worst)];
  std::string others;
  for (Eigen::Index i = 0; i < far.size(); ++i) {
    if (i == worst || far[i] < kAsFar * far[worst]) continue;
    others = with_word(others, readings[static_cast<std::size_t>(i)].key);
  }
  throw InputError(
      file + ": " + one.key + ": " + number_text(one.reading.value / one.unit) + ": is " +
      decimal_text(far[worst], 1) + " standard deviations off what the other readings say" +
      (others.empty() ? "" : ", as far as " + others) + ": measure it again or take it out");
}

}  // namespace

double to_digits(double value, double uncertainty) {
  const double digits = std::pow(10.0, 2.0 - std::floor(std::log10(uncertainty)));
  return std::round(value * digits) / digits + 0.0;  // No negative zero.
}

namespace {

/// @param unit  of the value per unit of the parameter.
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
  const CouponState state = state_of(solution.best, solution.order);
  const double diameter = 2.0 * state.radius;
  fit.sigma = value_of(solution, kSigma, state.sigma, {"polish.sigma", own.sigma}, state.sigma);
  fit.floor =
      value_of(solution, kFloor, 1.0, {"polish.floor", own.floor}, std::max(0.0, state.floor));
  fit.order = {"polish.order", static_cast<double>(solution.order)};
  fit.diameter =
      value_of(solution, kRadius, diameter, {"tool.diameter", 2.0 * own.radius}, diameter);
  fit.pitch_error = value_of(solution, kPitchError, 1.0, {"finish.pitch_error", own.pitch_error},
                             state.pitch_error);
  const Roughness& rough = state.roughness;
  fit.roughness =
      value_of(solution, kRoughness, rough.rms, {"polish.roughness", own.roughness.rms}, rough.rms);
  fit.correlation = value_of(solution, kCorrelation, rough.correlation,
                             {"polish.correlation", own.roughness.correlation}, rough.correlation);
  fit.touch_off =
      value_of(solution, kOffset, 1.0, {"touch-off (mm)", own.groove_offset}, state.groove_offset);
  const Eigen::VectorXd residuals = solution.problem.residuals(solution.best);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const ModelledReading& one = readings[i];
    fit.readings.push_back({one.key, one.reading.value / one.unit, one.predicted(state) / one.unit,
                            -residuals[static_cast<Eigen::Index>(i)]});
  }
  fit.chi_square = solution.chi_square;
  fit.freedom = static_cast<int>(readings.size()) - static_cast<int>(solution.problem.free.size());
  return fit;
}

}  // namespace

std::vector<const FittedValue*> CouponFit::values() const {
  std::vector<const FittedValue*> all{&sigma, &order, &floor, &diameter, &pitch_error};
  if (haze) all.insert(all.begin() + 3, {&roughness, &correlation});
  return all;
}

Workshop CouponFit::applied_to(Workshop workshop) const {
  if (sigma.determined) workshop.polish.sigma = sigma.value;
  if (sigma.determined) workshop.polish.order = static_cast<int>(order.value);
  if (floor.determined) workshop.polish.floor = floor.value;
  if (roughness.determined) workshop.polish.roughness = roughness.value;
  if (correlation.determined) workshop.polish.correlation = correlation.value;
  if (pitch_error.determined) workshop.process.finish.pitch_error = pitch_error.value;
  for (Tool& tool : workshop.tools) {
    if (diameter.determined && tool.number == workshop.process.finish.tool) {
      tool.diameter = diameter.value;
    }
  }
  return workshop;
}

namespace {

constexpr double kFloorStart = 0.02;  ///< Of a search for a floor.

/// The fit of these parameters, less those that the readings do not determine.
Solution solved_with(const std::vector<ModelledReading>& readings, const CouponState& own,
                     int order, std::vector<int> free) {
  Solution solution{order, problem_of(readings, order), {}, {}};
  solution.problem.free = std::move(free);
  solution.solve(own);
  for (int held = unknown_among(solution); held >= 0; held = unknown_among(solution)) {
    std::erase(solution.problem.free, held);
    solution.solve(own);
  }
  return solution;
}

/// The fit for one order: with the floor free where that makes a difference or the workshop has
/// one.
Solution solved(const std::vector<ModelledReading>& readings, const CouponState& own, int order,
                const std::vector<int>& free) {
  Solution held = solved_with(readings, own, order, free);
  if (!held.place(kSigma)) return held;
  Solution open = held;
  open.problem.free.push_back(kFloor);
  Eigen::VectorXd begin = held.best;
  begin[kFloor] = std::max(begin[kFloor], kFloorStart);
  open.settle(minimize(open.problem, begin));
  if (!(open.quality.uncertainties[*open.place(kFloor)] <= kFloorMost)) return held;
  const bool better = held.chi_square - open.chi_square > kPreference * kPreference;
  return own.floor > 0.0 || (better && open.best[kFloor] > 0.0) ? open : held;
}

/// The order that the readings prefer, by how many standard errors. @return that of the workshop if
/// they prefer neither.
std::pair<Solution, double> preferred(const std::vector<ModelledReading>& readings,
                                      const CouponState& own, const std::vector<int>& free) {
  Solution pads = solved(readings, own, kPadOrder, free);
  Solution film = solved(readings, own, kFilmOrder, free);
  const double apart = std::sqrt(std::abs(pads.chi_square - film.chi_square));
  const bool known = apart >= kPreference && pads.place(kSigma) && film.place(kSigma);
  const int order =
      known ? (film.chi_square < pads.chi_square ? kFilmOrder : kPadOrder) : own.order;
  return {order == kFilmOrder ? film : pads, known ? apart : 0.0};
}

}  // namespace

CouponFit fit_coupon(const CouponReadings& readings, const Workshop& workshop,
                     const std::string& file, std::optional<int> order) {
  const std::vector<ModelledReading> modelled = modelled_readings(readings);
  if (modelled.empty()) {
    throw InputError(file + ": 0 readings: fill in at least one, and take the # away before it");
  }
  const CouponState own = CouponState::of(workshop);
  require_plausible(modelled, own, file);
  const std::vector<int> free = touched(readings);
  auto [solution, apart] =
      order ? std::pair(solved(modelled, own, *order, free), 0.0) : preferred(modelled, own, free);
  if (solution.quality.deletion.cwiseAbs().maxCoeff() > kMaxDeviation) {
    // A wrong reading may look like another polish: the workshop's own names it.
    require_agreement(modelled, solved_with(modelled, own, order.value_or(own.order), free).quality,
                      file);
  }
  require_agreement(modelled, solution.quality, file);
  take_in(solution, kRadius, kRadiusShare, kSigma);
  take_in(solution, kCorrelation, kCorrelationShare, kRoughness);
  CouponFit fit = result_of(modelled, own, solution);
  fit.haze = contains(free, kRoughness);
  fit.order.determined = apart > 0.0;
  fit.order_apart = apart;
  return fit;
}

CouponFit expected_fit(const CouponReadings& expected, const Workshop& workshop) {
  return fit_coupon(expected, workshop, "expected readings");
}

namespace {

/// Offset of a line and a column in the text, both counted from 1.
std::size_t offset_of(const std::string& text, const toml::source_position& place) {
  std::size_t begin = 0;
  for (toml::source_index line = 1; line < place.line; ++line) begin = text.find('\n', begin) + 1;
  return begin + place.column - 1;
}

/// Replaces a number in the text.
void replace_number(std::string& text, const toml::node& node, double value) {
  constexpr std::string_view kEnds = " \t\r\n,}]#";
  const std::size_t begin = offset_of(text, node.source().begin);
  const std::size_t end = std::min(text.find_first_of(kEnds, begin), text.size());
  text.replace(begin, end - begin, shortest_text(value));
}

/// Sets a key of one of the document's tables, which may lack the key or be missing itself.
void set_number(std::string& text, const std::string& table, const std::string& key, double value) {
  const toml::table document = toml::parse(text);
  const std::string line = key + " = " + shortest_text(value) + "\n";
  const toml::table* const found = document[table].as_table();
  if (found == nullptr) {
    if (!text.empty()) text += text.ends_with('\n') ? "\n" : "\n\n";
    text += "[" + table + "]\n" + line;
  } else if (const toml::node* const node = found->get(key)) {
    replace_number(text, *node, value);
  } else {
    const std::size_t header = offset_of(text, found->source().begin);
    const std::size_t end = text.find('\n', header);
    if (end == std::string::npos) text += "\n";
    text.insert(std::min(end, text.size() - 1) + 1, line);
  }
}

/// Sets the diameter of a tool, which states it if there is a list of tools.
void set_diameter(std::string& text, int number, double value) {
  const toml::table document = toml::parse(text);
  const toml::array* const tools = document["tool"].as_array();
  if (tools == nullptr) return;
  for (const toml::node& node : *tools) {
    const toml::table* const tool = node.as_table();
    if (tool == nullptr || (*tool)["number"].value_or(Tool{}.number) != number) continue;
    if (const toml::node* const diameter = tool->get("diameter")) {
      return replace_number(text, *diameter, value);
    }
  }
}

}  // namespace

std::optional<std::string> edited_workshop(const std::string& text, const Workshop& to) {
  try {
    const Workshop from = parse_workshop(text, "workshop");
    const FinishProcess& finish = to.process.finish;
    std::string edited = text;
    const PolishModel& was = from.polish;
    const auto change = [&](const char* table, const char* key, double before, double after) {
      if (before != after) set_number(edited, table, key, after);
    };
    change("polish", "sigma", was.sigma, to.polish.sigma);
    change("polish", "order", was.order, to.polish.order);
    change("polish", "floor", was.floor, to.polish.floor);
    change("polish", "roughness", was.roughness, to.polish.roughness);
    change("polish", "correlation", was.correlation, to.polish.correlation);
    change("finish", "pitch_error", from.process.finish.pitch_error, finish.pitch_error);
    const double diameter = to.tool(finish.tool).diameter;
    if (from.tool(finish.tool).diameter != diameter) set_diameter(edited, finish.tool, diameter);
    if (parse_workshop(edited, "workshop") == to) return edited;
  } catch (const InputError&) {
  } catch (const toml::parse_error&) {
  }
  return std::nullopt;
}

namespace {

constexpr std::size_t kLongestName = 200;  ///< Of the readings' file, in a comment.

constexpr std::string_view kFitted = "# Fitted by ";
constexpr std::string_view kValue = "#   ";

bool determines_any(const CouponFit& fit) {
  const std::vector<const FittedValue*> values = fit.values();
  return std::any_of(values.begin(), values.end(), [](const auto* one) { return one->determined; });
}

/// One line of each value.
std::vector<std::string> fitted_lines(const CouponFit& fit) {
  std::vector<std::string> lines;
  for (const FittedValue* value : fit.values()) {
    lines.push_back(value == &fit.order && value->determined
                        ? value->key + " = " + number_text(value->value) + ", by " +
                              number_text(fit.order_apart, 2) + " standard errors"
                        : fitted_line(*value));
  }
  return lines;
}

/// The file without the comments of an earlier fit at its beginning.
std::string without_fitted(std::string text) {
  if (!text.starts_with(kFitted)) return text;
  do {
    text.erase(0, std::min(text.find('\n'), text.size() - 1) + 1);
  } while (text.starts_with(kValue));
  return text;
}

}  // namespace

std::string fitted_line(const FittedValue& value) {
  return value.key + (value.determined ? " = " + number_text(value.value) + " +- " +
                                             number_text(value.uncertainty, 2)
                                       : " is not determined, left as it was");
}

std::string fitted_workshop(const std::string& text, const Workshop& fitted,
                            const std::string& source, const std::vector<std::string>& lines) {
  std::string file =
      std::string(kFitted) + program_mark() + " to " + printable_line(source, kLongestName) + ":\n";
  for (const std::string& line : lines) file += std::string(kValue) + line + "\n";
  return file + edited_workshop(without_fitted(text), fitted).value_or(workshop_toml(fitted));
}

CouponFit fit_workshop(const WorkshopFit& task) {
  const std::string name = task.readings.string();
  const CouponReadings readings =
      parse_readings(read_toml_file(task.readings, "a file of readings"), name);
  CouponFit fit = fit_coupon(readings, task.workshop, name);
  if (!determines_any(fit)) {
    throw InputError(name + ": " + std::to_string(readings.count()) +
                     " readings: determine neither polish.sigma, polish.roughness, tool.diameter "
                     "nor finish.pitch_error; take more of them, or more exact ones");
  }
  const Workshop fitted = fit.applied_to(task.workshop);
  validate(fitted, name + ", the workshop as fitted");
  require_replaceable("--out", task.out, task.force);
  task.before_writing();
  write_whole_file(task.out, fitted_workshop(task.workshop_text, fitted, name, fitted_lines(fit)));
  return fit;
}

}  // namespace lensforge
