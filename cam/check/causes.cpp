// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/causes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"

namespace lensforge {
namespace {

/// Evidence that every cause must add: a deviation of some 5.5 standard errors, since a model that
/// follows one cause imperfectly explains the rest by others.
constexpr double kCost = 30.0;
/// Evidence that an alternative may lack.
constexpr double kAlike = 12.0;
/// The same between a tilt of the wall and one of the part: what the model leaves of a camera
/// brought up to 37 for the wrong one where the part was tilted by 1 to 2.5°.
constexpr double kAlikeTilt = 60.0;
constexpr int kMostCauses = 4;
/// Sets of causes that are fitted in every search: evidence is to first order only, and far from
/// the photograph that misleads.
constexpr std::ptrdiff_t kTried = 3;
constexpr int kMostSearches = 6;
constexpr int kMostRounds = 6;
/// Steps shorter than this share of deviation_steps() end a fit.
constexpr double kShortStep = 0.02;

WallPicture sum_of(WallPicture sum, double factor, const WallPicture& other) {
  for (std::size_t i = 0; i < sum.light.values().size(); ++i) {
    sum.light.values()[i] += static_cast<float>(factor) * other.light.values()[i];
  }
  sum.log_size += factor * other.log_size;
  return sum;
}

/// The part's tilt about the same axis for a tilt of the wall, and the other way round; none for
/// other deviations. Both bring one side of the lens nearer to the wall and differ by squares of
/// the angle only, so that one of them stands for both wherever changes are to first order.
std::optional<Deviation> other_tilt(Deviation tilt) {
  switch (tilt) {
    case Deviation::kTiltX:
      return Deviation::kPartTiltX;
    case Deviation::kTiltY:
      return Deviation::kPartTiltY;
    case Deviation::kPartTiltX:
      return Deviation::kTiltX;
    case Deviation::kPartTiltY:
      return Deviation::kTiltY;
    default:
      return std::nullopt;
  }
}

bool is_of_part(Deviation tilt) {
  return tilt == Deviation::kPartTiltX || tilt == Deviation::kPartTiltY;
}

/// Whose tilt stands for both, about axes where neither is active.
enum class Standing { kWall, kPart };

/// A fit of a view and of some deviations.
class DeviationFit {
 public:
  DeviationFit(const WallModel& model, const SeenPixels& pixels, Eigen::VectorXd view,
               const RunControl& control)
      : model_(&model),
        pixels_(&pixels),
        control_(&control),
        steps_(deviation_steps(model.lens().setup)),
        limits_(deviation_limits(model.lens().setup)),
        view_(std::move(view)) {
    at_.setZero();
  }

  [[nodiscard]] const Eigen::VectorXd& view() const { return view_; }
  [[nodiscard]] const Deviations& deviations() const { return at_; }
  [[nodiscard]] const std::vector<Deviation>& active() const { return active_; }
  [[nodiscard]] double square() const { return left_.squaredNorm(); }
  /// What the fit leaves.
  [[nodiscard]] const Eigen::VectorXd& left() const { return left_; }
  [[nodiscard]] double samples() const { return static_cast<double>(pixels_->size()); }

  /// These may differ from 0; the others no longer do.
  void activate(const std::vector<Deviation>& active) {
    const Deviations before = at_;
    at_.setZero();
    for (const Deviation d : active) at_[index_of(d)] = before[index_of(d)];
    active_ = active;
  }
  /// Where the fit begins. @pre the deviation is active.
  void start(Deviation deviation, double value) { at_[index_of(deviation)] = value; }
  /// Fits view and active deviations.
  void run();

  /// What view and deviations change, to first order, around the fit.
  struct Tangents {
    Eigen::VectorXd residuals;
    Eigen::MatrixXd view;
    Eigen::MatrixXd columns;  ///< One per deviation and step of it; 0 for those that do not show.

    /// The same less what the view could change as well.
    [[nodiscard]] Tangents beyond_view() const;
  };
  [[nodiscard]] Tangents tangents(Standing standing) const;
  [[nodiscard]] const Deviations& steps() const { return steps_; }
  [[nodiscard]] const DeviationLimits& limits() const { return limits_; }
  [[nodiscard]] const SeenPixels& pixels() const { return *pixels_; }
  [[nodiscard]] bool may_show(Deviation deviation) const { return model_->shows(deviation); }
  [[nodiscard]] bool is_active(Deviation deviation) const {
    return std::find(active_.begin(), active_.end(), deviation) != active_.end();
  }
  /// True if it can show, and none stands for it.
  [[nodiscard]] bool shows(Deviation deviation, Standing standing) const;

 private:
  /// @param near  deviations whose diffraction it has.
  [[nodiscard]] WallPicture wall(const Deviations& at, const Deviations& near) const {
    if (control_->stop_requested()) throw Interrupted();
    return wall_picture(*model_, at, near);
  }
  [[nodiscard]] WallPicture wall() const { return wall(at_, at_); }
  /// Change of the picture by one step.
  [[nodiscard]] WallPicture change(Deviation deviation, const WallPicture& from) const;

  /// Pictures by the view and steps of active deviations, in that order: linear in these.
  struct Line {
    WallPicture base;
    std::vector<WallPicture> changes;

    [[nodiscard]] WallPicture at(const Eigen::VectorXd& parameters) const;
  };
  [[nodiscard]] LeastSquares problem(const Line& line) const;
  /// Goes to such parameters. @return the longest step of a deviation.
  double take(const Eigen::VectorXd& parameters);

  const WallModel* model_;
  const SeenPixels* pixels_;
  const RunControl* control_;
  Deviations steps_;
  DeviationLimits limits_;
  Eigen::VectorXd view_;
  Deviations at_;
  std::vector<Deviation> active_;
  Eigen::VectorXd left_;
};

WallPicture DeviationFit::change(Deviation deviation, const WallPicture& from) const {
  const Eigen::Index i = index_of(deviation);
  Deviations moved = at_;
  // Scallops show below the planned polish, and ever faster: from there its step is towards them.
  const bool to_scallops =
      deviation == Deviation::kPolish && at_[i] < 0.0 && at_[i] - steps_[i] > limits_.least[i];
  const double way = to_scallops || at_[i] + steps_[i] > limits_.most[i] ? -1.0 : 1.0;
  moved[i] += way * steps_[i];
  const WallPicture there = wall(moved, at_);
  return way > 0.0 ? sum_of(there, -1.0, from) : sum_of(from, -1.0, there);
}

WallPicture DeviationFit::Line::at(const Eigen::VectorXd& parameters) const {
  WallPicture picture = base;
  for (std::size_t k = 0; k < changes.size(); ++k) {
    const double by = parameters[view::kCount + static_cast<Eigen::Index>(k)];
    if (by != 0.0) picture = sum_of(std::move(picture), by, changes[k]);
  }
  return picture;
}

LeastSquares DeviationFit::problem(const Line& line) const {
  const auto count = view::kCount + std::ssize(line.changes);
  LeastSquares problem = view_problem();
  problem.longest.conservativeResize(count);
  problem.longest.tail(std::ssize(line.changes)).setConstant(3.0);
  problem.free.resize(static_cast<std::size_t>(count));
  std::iota(problem.free.begin(), problem.free.end(), 0);
  problem.residuals = [this, &line](const Eigen::VectorXd& p) {
    return Eigen::VectorXd(pixels_->shown(p.head(view::kCount), line.at(p)) - pixels_->seen());
  };
  problem.derivatives = [this, &line, count](const Eigen::VectorXd& p) {
    constexpr double kStep = 0.1;
    const WallPicture now = line.at(p);
    const Eigen::VectorXd view = p.head(view::kCount);
    const Eigen::VectorXd shown = pixels_->shown(view, now);
    Eigen::MatrixXd rows = pixels_->derivatives(view, now);
    rows.conservativeResize(Eigen::NoChange, count);
    for (std::size_t k = 0; k < line.changes.size(); ++k) {
      const WallPicture beyond = sum_of(now, kStep, line.changes[k]);
      rows.col(view::kCount + static_cast<Eigen::Index>(k)) =
          (pixels_->shown(view, beyond) - shown) / kStep;
    }
    return rows;
  };
  return problem;
}

double DeviationFit::take(const Eigen::VectorXd& parameters) {
  view_ = parameters.head(view::kCount);
  double longest = 0.0;
  for (std::size_t k = 0; k < active_.size(); ++k) {
    const Eigen::Index i = index_of(active_[k]);
    const double before = at_[i];
    const double by = steps_[i] * parameters[view::kCount + static_cast<Eigen::Index>(k)];
    at_[i] = std::clamp(before + by, limits_.least[i], limits_.most[i]);
    longest = std::max(longest, std::abs(at_[i] - before) / steps_[i]);
  }
  return longest;
}

void DeviationFit::run() {
  for (int round = 0; round < kMostRounds; ++round) {
    Line line{wall(), {}};
    for (const Deviation d : active_) line.changes.push_back(change(d, line.base));
    Eigen::VectorXd start = Eigen::VectorXd::Zero(view::kCount + std::ssize(active_));
    start.head(view::kCount) = view_;
    if (take(minimize(problem(line), start)) < kShortStep) break;
  }
  left_ = pixels_->shown(view_, wall()) - pixels_->seen();
}

bool DeviationFit::shows(Deviation deviation, Standing standing) const {
  if (!model_->shows(deviation)) return false;
  const auto other = other_tilt(deviation);
  if (!other || is_active(deviation) || !model_->shows(*other)) return true;
  return !is_active(*other) && is_of_part(deviation) == (standing == Standing::kPart);
}

DeviationFit::Tangents DeviationFit::tangents(Standing standing) const {
  const WallPicture base = wall();
  const Eigen::VectorXd shown = pixels_->shown(view_, base);
  Tangents result{pixels_->seen() - shown, pixels_->derivatives(view_, base),
                  Eigen::MatrixXd::Zero(shown.size(), static_cast<int>(kDeviations))};
  for (std::size_t k = 0; k < kDeviations; ++k) {
    const auto d = static_cast<Deviation>(k);
    if (!shows(d, standing)) continue;
    const WallPicture moved = sum_of(base, 1.0, change(d, base));
    result.columns.col(static_cast<Eigen::Index>(k)) = pixels_->shown(view_, moved) - shown;
  }
  return result;
}

DeviationFit::Tangents DeviationFit::Tangents::beyond_view() const {
  Eigen::MatrixXd basis = view;
  for (Eigen::Index k = 0; k < basis.cols(); ++k) basis.col(k).normalize();
  basis = basis.colPivHouseholderQr().householderQ() *
          Eigen::MatrixXd::Identity(basis.rows(), basis.cols());
  Tangents rest = *this;
  rest.columns -= basis * (basis.transpose() * columns);
  rest.residuals -= basis * (basis.transpose() * residuals);
  return rest;
}

constexpr double kFaintest = 1e-6;  ///< Change per step of a display value, rms, that counts as 0.

/// Standard deviation with which a deviation occurs, about; of what a workshop's tolerances state,
/// theirs would be too small: a photograph is checked because something is wrong.
Deviations prior_of(const Deviations& steps) {
  Deviations prior;
  prior << 0.03, 0.05, 0.05, 0.05, 0.05, 4.0 * steps[index_of(Deviation::kLampSize)], 0.01, 0.003,
      0.3, 0.1, 0.005, 0.02, 0.1;
  return prior;
}

/// Standard deviation of what is found of a deviation where nothing is wrong: cameras and
/// predictions are no better. At least 0.8 of what eight photographs of a virtual wall had, rms.
Deviations model_error(const Deviations& steps) {
  Deviations error;
  error << 0.0012, 0.003, 0.003, 0.003, 0.003, 0.03 * steps[index_of(Deviation::kLampSize)], 0.0012,
      0.002, 0.02, 0.02, 0.0001, 3e-4, 0.0015;
  return error;
}

/// Deviations that all scale the way from the surface to the wall: modulo a homography they are the
/// same to first order, and together they would only cancel.
bool scales_throw(Deviation deviation) {
  return deviation == Deviation::kDistance || deviation == Deviation::kLampDistance ||
         deviation == Deviation::kIndex;
}

/// Changes of display values, rms, by a ball that is 10 % larger: under the usual polish, and from
/// which on the ball is named, since its scallops show.
constexpr double kBallHidden = 1.6e-4;
constexpr double kBallShows = 0.002;
/// model_error() of a ball at best, a share.
constexpr double kBallError = 0.002;

/// Compares all sets of causes at once, linear around a fit, with the view free.
///
/// Notation: r what the fit without deviations would leave, C the changes by steps of deviations,
/// both less what the view could do; P = CᵀC, b = Cᵀr. Any deviation v is normal with the variance
/// w of model_error(), and that of prior_of() besides if it is among the causes. A set of causes
/// then has the least of |r − C v|² / s² + Σ v² / w, at v = (P + s² W⁻¹)⁻¹ b. s² is the variance of
/// a pixel times τ: N pixels hold N / τ independent values, by what all deviations together leave.
class JointTest {
 public:
  explicit JointTest(const DeviationFit& fit, Standing standing = Standing::kWall)
      : steps_(fit.steps()), limits_(fit.limits()), chart_(fit.pixels().tie().has_value()) {
    const Deviations own = model_error(steps_).cwiseQuotient(steps_);
    const Deviations prior = prior_of(steps_).cwiseQuotient(steps_);
    own_ = own.cwiseAbs2();
    prior_ = prior.cwiseAbs2();
    const DeviationFit::Tangents tangents = fit.tangents(standing).beyond_view();
    const Eigen::MatrixXd& columns = tangents.columns;
    const Eigen::VectorXd rest =
        tangents.residuals + columns * fit.deviations().cwiseQuotient(steps_);
    products_ = columns.transpose() * columns;
    along_ = columns.transpose() * rest;
    samples_ = fit.samples();
    square_ = rest.squaredNorm();
    // What the model leaves reads as the less of a ball, the better its scallops show.
    const Eigen::Index ball = index_of(Deviation::kBall);
    const double finest = std::pow(kBallError / steps_[ball], 2);
    const double share = std::min(1.0, kBallHidden / std::max(ball_shows(), kBallHidden));
    own_[ball] = std::max(finest, own_[ball] * share * share);
    for (std::size_t k = 0; k < kDeviations; ++k) {
      const auto d = static_cast<Deviation>(k);
      if (products_(index_of(d), index_of(d)) > kFaintest * kFaintest * fit.samples()) {
        showing_.push_back(d);
      }
    }
    variance_ = tangents.residuals.squaredNorm() / fit.samples();
    const Eigen::VectorXd least = rest - columns * estimate(showing_, variance_).steps;
    variance_ = least.squaredNorm() / fit.samples() * fit.pixels().values_alike(least);
  }

  [[nodiscard]] const std::vector<Deviation>& showing() const { return showing_; }

  /// True for deviations that show and that tables of photographs on a virtual wall prove
  /// (docs/check.md). The others may stand in their place, or be measured.
  [[nodiscard]] bool may_be_named(Deviation deviation) const {
    if (std::find(showing_.begin(), showing_.end(), deviation) == showing_.end()) return false;
    switch (deviation) {
      case Deviation::kIndex:
        return false;
      case Deviation::kLampDistance:
        return chart_;
      case Deviation::kBall:
        return ball_shows() > kBallShows;
      default:
        return true;
    }
  }

  /// By how much a photograph is likelier, in ln likelihood times 2, with a set of causes than with
  /// none, less their cost; infinitely less for sets that are not named.
  [[nodiscard]] double evidence(const std::vector<Deviation>& causes) const {
    const Estimate with = estimate(causes, variance_);
    if (!named(causes, with.steps)) return -std::numeric_limits<double>::infinity();
    return with.gain - estimate({}, variance_).gain - kCost * static_cast<double>(causes.size());
  }

  /// What speaks against a set of causes, in the same unit: comparable between fits.
  /// @param variance  s²
  [[nodiscard]] double misfit(const std::vector<Deviation>& causes, double variance) const {
    return square_ / variance - estimate(causes, variance).gain +
           kCost * static_cast<double>(causes.size());
  }
  [[nodiscard]] double variance() const { return variance_; }

  /// Sets of at most `most` causes with evidence, the most of it first, kTried of them.
  [[nodiscard]] std::vector<std::vector<Deviation>> best(int most) const {
    std::vector<Deviation> candidates;
    std::copy_if(showing_.begin(), showing_.end(), std::back_inserter(candidates),
                 [&](Deviation d) { return may_be_named(d); });
    std::vector<std::pair<double, std::vector<Deviation>>> sets;
    for (unsigned mask = 1; mask < 1U << candidates.size(); ++mask) {
      if (std::popcount(mask) > most) continue;
      std::vector<Deviation> causes;
      for (std::size_t k = 0; k < candidates.size(); ++k) {
        if (((mask >> k) & 1U) != 0) causes.push_back(candidates[k]);
      }
      const double now = evidence(causes);
      if (now > 0.0) sets.emplace_back(now, causes);
    }
    std::stable_sort(sets.begin(), sets.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    std::vector<std::vector<Deviation>> best;
    for (const auto& [with, causes] : sets) {
      if (std::ssize(best) == kTried) break;
      best.push_back(causes);
    }
    return best;
  }

  /// A value and its standard error.
  struct Value {
    double value = 0.0;
    double error = 0.0;
  };
  /// Of one of these causes.
  [[nodiscard]] Value value(const std::vector<Deviation>& causes, Deviation deviation) const {
    const Eigen::Index i = index_of(deviation);
    const Estimate with = estimate(causes, variance_);
    return {steps_[i] * with.steps[i], steps_[i] * std::sqrt(with.variances[i] + own_[i])};
  }

 private:
  struct Estimate {
    Deviations steps;
    Deviations variances;
    double gain = 0.0;  ///< |r|² / s² less the least sum.
  };
  [[nodiscard]] Estimate estimate(const std::vector<Deviation>& causes, double variance) const {
    Deviations weights = own_;
    for (const Deviation d : causes) weights[index_of(d)] += prior_[index_of(d)];
    Eigen::MatrixXd matrix = products_ / variance;
    matrix.diagonal() += weights.cwiseInverse();
    const Eigen::MatrixXd inverse =
        matrix.ldlt().solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
    Estimate result;
    result.steps = inverse * along_ / variance;
    result.variances = inverse.diagonal();
    result.gain = result.steps.dot(along_) / variance;
    return result;
  }

  /// Change of display values, rms, by a ball that is 10 % larger.
  [[nodiscard]] double ball_shows() const {
    constexpr double kLarger = 0.1;
    const Eigen::Index i = index_of(Deviation::kBall);
    return kLarger / steps_[i] * std::sqrt(products_(i, i) / samples_);
  }

  /// True if values, in steps, are within limits, and one cause at most scales the throw; with a
  /// chart, two may: a lamp's distance also changes the picture's size.
  [[nodiscard]] bool named(const std::vector<Deviation>& causes, const Deviations& values) const {
    for (const Deviation d : causes) {
      const double value = values[index_of(d)] * steps_[index_of(d)];
      if (value > limits_.most[index_of(d)] || value < limits_.least[index_of(d)]) return false;
    }
    return std::count_if(causes.begin(), causes.end(), scales_throw) <= (chart_ ? 2 : 1);
  }

  Deviations steps_;
  Deviations own_, prior_;  ///< Variances of model_error() and prior_of(), in steps.
  DeviationLimits limits_;
  bool chart_;
  Eigen::MatrixXd products_;
  Deviations along_;
  double samples_ = 0.0;   ///< Of r.
  double square_ = 0.0;    ///< |r|²
  double variance_ = 0.0;  ///< s²
  std::vector<Deviation> showing_;
};

/// What each deviation would be if it were added to the causes.
void describe_all(const DeviationFit& fit, const JointTest& test, CauseFit& result) {
  for (const Deviation d : test.showing()) {
    std::vector<Deviation> causes = fit.active();
    const bool active = fit.is_active(d);
    if (!active) causes.push_back(d);
    const JointTest::Value value = test.value(causes, d);
    result.alone[index_of(d)] = active ? fit.deviations()[index_of(d)] : value.value;
    result.errors[index_of(d)] = value.error;
  }
}

}  // namespace

WallPicture wall_picture(const WallModel& model, const Deviations& deviations,
                         const Deviations& near) {
  return {model.picture(deviations, near), model.margin() * model.fine(),
          model.log_size(deviations)};
}

WallPicture wall_picture(const WallModel& model, const Deviations& deviations) {
  return wall_picture(model, deviations, deviations);
}

namespace {

/// A cause alone, and a value of it where a search for it begins besides the forecast.
struct DistantStart {
  Deviation cause;
  double value;
  double least = 0.0;  ///< CauseFit::systematic from which on it is tried.
};
/// Above what is left where nothing is wrong, 0.0004, and below what a wall 2 % off leaves.
constexpr double kUnexplained = 0.001;
/// Scallops that a weaker polish leaves show suddenly, so that nothing of them is in the
/// derivatives around the forecast; where they show, those of a ball that is a sixth off have
/// little in common with what the derivatives tell. So has what diffraction makes of a wall that
/// is 2 % nearer.
constexpr std::array<DistantStart, 5> kDistantStarts{{{Deviation::kPolish, -0.35},
                                                      {Deviation::kBall, -0.15},
                                                      {Deviation::kBall, 0.15},
                                                      {Deviation::kDistance, -0.02, kUnexplained},
                                                      {Deviation::kDistance, 0.02, kUnexplained}}};

/// A fit and what speaks for and against its causes.
struct TestedFit {
  DeviationFit fit;
  JointTest test;

  explicit TestedFit(DeviationFit of) : fit(std::move(of)), test(fit) {}

  /// False if a cause is within three of its standard errors.
  [[nodiscard]] bool is_certain() const {
    constexpr double kLeast = 3.0;
    const std::vector<Deviation>& causes = fit.active();
    return std::all_of(causes.begin(), causes.end(), [&](Deviation d) {
      return std::abs(fit.deviations()[index_of(d)]) > kLeast * test.value(causes, d).error;
    });
  }
  /// By how much more speaks against another fit.
  [[nodiscard]] double better_by(const TestedFit& other) const {
    const double variance = std::min(test.variance(), other.test.variance());
    return other.test.misfit(other.fit.active(), variance) - test.misfit(fit.active(), variance);
  }
};

/// The same view with these causes, fitted.
TestedFit with_causes(DeviationFit fit, const std::vector<Deviation>& causes) {
  fit.activate(causes);
  fit.run();
  return TestedFit(std::move(fit));
}

TestedFit with_cause_from(DeviationFit fit, const DistantStart& start) {
  fit.activate({start.cause});
  fit.start(start.cause, start.value);
  fit.run();
  return TestedFit(std::move(fit));
}

/// The same causes, but the other tilt about an axis in place of one; none if it cannot show.
std::optional<TestedFit> with_other_tilt(const TestedFit& of, Deviation tilt) {
  const std::optional<Deviation> other = other_tilt(tilt);
  if (!other || !of.fit.may_show(*other)) return std::nullopt;
  std::vector<Deviation> causes = of.fit.active();
  std::replace(causes.begin(), causes.end(), tilt, *other);
  DeviationFit fit = of.fit;
  fit.activate(causes);
  fit.start(*other, -of.fit.deviations()[index_of(tilt)]);
  fit.run();
  return TestedFit(std::move(fit));
}

/// The best fit with at most so many causes around another.
TestedFit search(const TestedFit& from, int most) {
  TestedFit best = from;
  const auto take = [&](TestedFit next) {
    if (next.is_certain() && next.better_by(best) > 0.0) best = std::move(next);
  };
  for (const std::vector<Deviation>& causes : from.test.best(most)) {
    if (causes != from.fit.active()) take(with_causes(from.fit, causes));
  }
  const double systematic = from.fit.pixels().shared_by_neighbours(from.fit.left());
  for (const DistantStart& start : kDistantStarts) {
    if (most > 1 || systematic < start.least || !from.test.may_be_named(start.cause)) continue;
    take(with_cause_from(from.fit, start));
  }
  if (best.fit.active() != from.fit.active()) {
    for (const Deviation d : std::vector<Deviation>(best.fit.active())) {
      auto other = with_other_tilt(best, d);
      if (other && other->fit.square() < best.fit.square()) take(*std::move(other));
    }
  }
  return best;
}

/// Evidence, standard error and alternatives of an active deviation.
FoundCause described(const TestedFit& best, Deviation deviation) {
  const JointTest& test = best.test;
  const std::vector<Deviation>& active = best.fit.active();
  const double with = test.evidence(active);
  std::vector<Deviation> others = active;
  std::erase(others, deviation);
  FoundCause cause;
  cause.deviation = deviation;
  cause.value = best.fit.deviations()[index_of(deviation)];
  cause.error = test.value(active, deviation).error;
  const double without = test.evidence(others);
  cause.evidence = std::isfinite(without) ? with - without : with;
  for (const Deviation d : test.showing()) {
    if (best.fit.is_active(d)) continue;
    std::vector<Deviation> instead = others;
    instead.push_back(d);
    if (test.evidence(instead) > with - kAlike) cause.alternatives.push_back(d);
  }
  // To first order nothing tells it apart.
  const std::optional<TestedFit> other = with_other_tilt(best, deviation);
  if (other && best.better_by(*other) < kAlikeTilt) {
    cause.alternatives.push_back(*other_tilt(deviation));
  }
  return cause;
}

}  // namespace

CauseFit find_causes(const WallModel& model, const SeenPixels& pixels, const Eigen::VectorXd& view,
                     const RunControl& control) {
  SeenPixels tied = pixels;
  DeviationFit none(model, tied, view, control);
  none.run();
  if (tied.tie()) {
    tied.trust_bar(std::sqrt(JointTest(none).variance()));
    none.run();
  }
  CauseFit result;
  result.unexplained = std::sqrt(none.square() / none.samples());
  TestedFit best(std::move(none));
  for (int count = 1; count <= kMostSearches; ++count) {
    control.report(
        {"check", double{1} * count, 0.0, "looking for causes, search " + std::to_string(count)});
    TestedFit next = search(best, std::min(count, kMostCauses));
    if (next.fit.active() == best.fit.active()) break;
    best = std::move(next);
  }
  const DeviationFit& fit = best.fit;
  const JointTest& test = best.test;
  describe_all(fit, JointTest(fit, Standing::kPart), result);
  describe_all(fit, test, result);
  for (const Deviation d : fit.active()) result.found.push_back(described(best, d));
  std::sort(result.found.begin(), result.found.end(),
            [](const FoundCause& a, const FoundCause& b) { return a.evidence > b.evidence; });
  result.view = fit.view();
  result.deviations = fit.deviations();
  result.residual = std::sqrt(fit.square() / fit.samples());
  result.systematic = tied.shared_by_neighbours(fit.left());
  return result;
}

}  // namespace lensforge
