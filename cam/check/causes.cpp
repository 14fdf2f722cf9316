// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/causes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "core/error.h"

namespace lensforge {
namespace {

/// Evidence that every cause must add: some three times ln N, as in the Bayesian information
/// criterion, since predictions have errors of their own.
constexpr double kCost = 30.0;
/// Evidence that an alternative may lack.
constexpr double kAlike = 12.0;
constexpr int kMostCauses = 4;
constexpr int kMostSearches = 6;
constexpr int kMostRounds = 4;
/// Steps shorter than this share of deviation_steps() end a fit.
constexpr double kShortStep = 0.02;

Image sum_of(const Image& image, double factor, const Image& other) {
  Image sum = image;
  for (std::size_t i = 0; i < sum.values().size(); ++i) {
    sum.values()[i] += static_cast<float>(factor) * other.values()[i];
  }
  return sum;
}

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
  [[nodiscard]] double square() const { return square_; }
  [[nodiscard]] double samples() const { return static_cast<double>(pixels_->size()); }

  /// These may differ from 0; the others no longer do.
  void activate(const std::vector<Deviation>& active) {
    const Deviations before = at_;
    at_.setZero();
    for (const Deviation d : active) at_[index_of(d)] = before[index_of(d)];
    active_ = active;
  }
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
  [[nodiscard]] Tangents tangents() const;
  [[nodiscard]] const Deviations& steps() const { return steps_; }
  [[nodiscard]] const DeviationLimits& limits() const { return limits_; }
  [[nodiscard]] const SeenPixels& pixels() const { return *pixels_; }

 private:
  [[nodiscard]] WallPicture wall(const Deviations& at) const {
    if (control_->stop_requested()) throw Interrupted();
    return wall_picture(*model_, at);
  }
  /// Change of the picture by one step.
  [[nodiscard]] Image change(Deviation deviation, const Image& from) const;

  const WallModel* model_;
  const SeenPixels* pixels_;
  const RunControl* control_;
  Deviations steps_;
  DeviationLimits limits_;
  Eigen::VectorXd view_;
  Deviations at_;
  std::vector<Deviation> active_;
  double square_ = 0.0;
};

Image DeviationFit::change(Deviation deviation, const Image& from) const {
  const Eigen::Index i = index_of(deviation);
  Deviations moved = at_;
  const double way = at_[i] + steps_[i] > limits_.most[i] ? -1.0 : 1.0;
  moved[i] += way * steps_[i];
  Image change = sum_of(wall(moved).light, -1.0, from);
  for (float& value : change.values()) value *= static_cast<float>(way);
  return change;
}

void DeviationFit::run() {
  const int count = view::kCount + static_cast<int>(active_.size());
  LeastSquares problem = view_problem();
  problem.longest.conservativeResize(count);
  problem.longest.tail(std::ssize(active_)).setConstant(3.0);
  problem.free.resize(static_cast<std::size_t>(count));
  std::iota(problem.free.begin(), problem.free.end(), 0);
  for (int round = 0; round < kMostRounds; ++round) {
    const WallPicture base = wall(at_);
    std::vector<Image> changes;
    for (const Deviation d : active_) changes.push_back(change(d, base.light));
    const auto moved = [&](const Eigen::VectorXd& p) {
      WallPicture picture = base;
      for (std::size_t k = 0; k < changes.size(); ++k) {
        const double by = p[view::kCount + static_cast<Eigen::Index>(k)];
        if (by != 0.0) picture.light = sum_of(picture.light, by, changes[k]);
      }
      return picture;
    };
    problem.residuals = [&](const Eigen::VectorXd& p) {
      return Eigen::VectorXd(pixels_->shown(p.head(view::kCount), moved(p)) - pixels_->seen());
    };
    problem.derivatives = [&](const Eigen::VectorXd& p) {
      const WallPicture now = moved(p);
      const Eigen::VectorXd view = p.head(view::kCount);
      const Eigen::VectorXd shown = pixels_->shown(view, now);
      Eigen::MatrixXd rows = pixels_->derivatives(view, now);
      rows.conservativeResize(Eigen::NoChange, count);
      for (std::size_t k = 0; k < changes.size(); ++k) {
        constexpr double kStep = 0.1;
        const WallPicture beyond{sum_of(now.light, kStep, changes[k]), now.margin};
        rows.col(view::kCount + static_cast<Eigen::Index>(k)) =
            (pixels_->shown(view, beyond) - shown) / kStep;
      }
      return rows;
    };
    Eigen::VectorXd start = Eigen::VectorXd::Zero(count);
    start.head(view::kCount) = view_;
    const Eigen::VectorXd end = minimize(problem, start);
    view_ = end.head(view::kCount);
    double longest = 0.0;
    for (std::size_t k = 0; k < active_.size(); ++k) {
      const Eigen::Index i = index_of(active_[k]);
      const double before = at_[i];
      at_[i] = std::clamp(before + end[view::kCount + static_cast<Eigen::Index>(k)] * steps_[i],
                          limits_.least[i], limits_.most[i]);
      longest = std::max(longest, std::abs(at_[i] - before) / steps_[i]);
    }
    if (longest < kShortStep) break;
  }
  square_ = (pixels_->shown(view_, wall(at_)) - pixels_->seen()).squaredNorm();
}

DeviationFit::Tangents DeviationFit::tangents() const {
  const WallPicture base = wall(at_);
  const Eigen::VectorXd shown = pixels_->shown(view_, base);
  Tangents result{pixels_->seen() - shown, pixels_->derivatives(view_, base),
                  Eigen::MatrixXd::Zero(shown.size(), static_cast<int>(kDeviations))};
  for (std::size_t k = 0; k < kDeviations; ++k) {
    const auto d = static_cast<Deviation>(k);
    if (!model_->shows(d)) continue;
    const WallPicture moved{sum_of(base.light, 1.0, change(d, base.light)), base.margin};
    result.columns.col(static_cast<Eigen::Index>(k)) = pixels_->shown(view_, moved) - shown;
  }
  return result;
}

DeviationFit::Tangents DeviationFit::Tangents::beyond_view() const {
  Eigen::MatrixXd basis = view;
  for (Eigen::Index k = 0; k < basis.cols(); ++k) basis.col(k).normalize();
  basis = Eigen::HouseholderQR<Eigen::MatrixXd>(basis).householderQ() *
          Eigen::MatrixXd::Identity(basis.rows(), basis.cols());
  Tangents rest = *this;
  rest.columns -= basis * (basis.transpose() * columns);
  rest.residuals -= basis * (basis.transpose() * residuals);
  return rest;
}

constexpr double kFaintest = 1e-6;  ///< Change per step of a display value, rms, that counts as 0.

/// Smaller deviations are not named: neither are cameras and predictions better.
Deviations least_named(const Deviations& steps) {
  Deviations least;
  least << 0.004, 0.012, 0.012, 0.12 * steps[index_of(Deviation::kLampSize)], 0.004, 0.003, 0.05,
      0.04, 0.0007, 0.02;
  return least;
}

/// Deviations that all scale the way from the surface to the wall: modulo a homography they are the
/// same to first order, and together they would only cancel.
bool scales_throw(Deviation deviation) {
  return deviation == Deviation::kDistance || deviation == Deviation::kLampDistance ||
         deviation == Deviation::kIndex;
}

/// Compares all sets of causes at once, linear around a fit, with the view free.
///
/// Notation: r what the fit without deviations would leave, C the changes by steps of deviations,
/// both less what the view could do; P = CᵀC, b = Cᵀr. A set of causes leaves |r|² − 2 v·b + vᵀPv
/// with v = (P + Λ)⁻¹ b, Λ from the prior. N pixels hold N / τ independent values, τ from the
/// correlation of what all deviations together leave.
class JointTest {
 public:
  JointTest(const DeviationFit& fit, const Deviations& prior)
      : steps_(fit.steps()),
        prior_(prior.cwiseQuotient(steps_)),
        least_(least_named(steps_).cwiseQuotient(steps_)),
        limits_(fit.limits()) {
    const DeviationFit::Tangents tangents = fit.tangents().beyond_view();
    const Eigen::MatrixXd& columns = tangents.columns;
    const Eigen::VectorXd rest =
        tangents.residuals + columns * fit.deviations().cwiseQuotient(steps_);
    products_ = columns.transpose() * columns;
    along_ = columns.transpose() * rest;
    square_ = rest.squaredNorm();
    variance_ = tangents.residuals.squaredNorm() / fit.samples();
    std::vector<Deviation> all;
    for (std::size_t k = 0; k < kDeviations; ++k) {
      const auto d = static_cast<Deviation>(k);
      if (products_(index_of(d), index_of(d)) > kFaintest * kFaintest * fit.samples()) {
        all.push_back(d);
      }
    }
    showing_ = all;
    const Eigen::VectorXd least = rest - columns * spread(all, values(all));
    independent_ = fit.samples() / fit.pixels().values_alike(least);
    variance_ = least.squaredNorm() / independent_;
  }

  [[nodiscard]] const std::vector<Deviation>& showing() const { return showing_; }

  /// True if values, in steps, are within limits and not below what is named.
  [[nodiscard]] bool named(const std::vector<Deviation>& causes,
                           const Eigen::VectorXd& values) const {
    for (std::size_t k = 0; k < causes.size(); ++k) {
      const Eigen::Index i = index_of(causes[k]);
      const double value = values[static_cast<Eigen::Index>(k)];
      if (std::abs(value) < least_[i] || value * steps_[i] > limits_.most[i] ||
          value * steps_[i] < limits_.least[i]) {
        return false;
      }
    }
    return std::count_if(causes.begin(), causes.end(), scales_throw) <= 1;
  }

  /// What speaks against deviations, in steps, beforehand.
  [[nodiscard]] double cost(const std::vector<Deviation>& causes,
                            const Eigen::VectorXd& values) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < causes.size(); ++k) {
      const double share = values[static_cast<Eigen::Index>(k)] / prior_[index_of(causes[k])];
      sum += kCost + share * share;
    }
    return sum;
  }

  /// By how much the photograph is likelier with a set of causes than with none, less their cost.
  [[nodiscard]] double evidence(const std::vector<Deviation>& causes) const {
    const Eigen::VectorXd v = values(causes);
    const Deviations all = spread(causes, v);
    const double left = square_ - 2.0 * all.dot(along_) + all.dot(products_ * all);
    return gain(square_, left) - cost(causes, v);
  }
  /// The same, and infinitely less for sets that are not named.
  [[nodiscard]] double evidence_if_named(const std::vector<Deviation>& causes) const {
    if (!named(causes, values(causes))) return -std::numeric_limits<double>::infinity();
    return evidence(causes);
  }
  /// The same of sums of squares.
  [[nodiscard]] double gain(double without, double with) const {
    return independent_ * std::log(without / std::max(with, 1e-9 * without));
  }

  /// The set of at most `most` causes with the most evidence; empty if none has any.
  [[nodiscard]] std::vector<Deviation> best(int most) const {
    std::vector<Deviation> best;
    double highest = 0.0;
    for (unsigned mask = 1; mask < 1U << showing_.size(); ++mask) {
      if (std::popcount(mask) > most) continue;
      std::vector<Deviation> causes;
      for (std::size_t k = 0; k < showing_.size(); ++k) {
        if (((mask >> k) & 1U) != 0) causes.push_back(showing_[k]);
      }
      const double now = evidence_if_named(causes);
      if (now <= highest) continue;
      highest = now;
      best = causes;
    }
    return best;
  }

  /// Standard error of one of these causes, fitted together.
  [[nodiscard]] double error(const std::vector<Deviation>& causes, Deviation deviation) const {
    const auto place = std::find(causes.begin(), causes.end(), deviation) - causes.begin();
    const Eigen::MatrixXd inverse = matrix(causes).inverse();
    return steps_[index_of(deviation)] * std::sqrt(variance_ * inverse(place, place));
  }

 private:
  [[nodiscard]] Eigen::MatrixXd matrix(const std::vector<Deviation>& causes) const {
    const auto size = std::ssize(causes);
    Eigen::MatrixXd part(size, size);
    for (Eigen::Index r = 0; r < size; ++r) {
      const Eigen::Index i = index_of(causes[static_cast<std::size_t>(r)]);
      for (Eigen::Index c = 0; c < size; ++c) {
        part(r, c) = products_(i, index_of(causes[static_cast<std::size_t>(c)]));
      }
      part(r, r) += variance_ / (prior_[i] * prior_[i]);
    }
    return part;
  }
  /// In steps.
  [[nodiscard]] Eigen::VectorXd values(const std::vector<Deviation>& causes) const {
    Eigen::VectorXd along(std::ssize(causes));
    for (std::size_t k = 0; k < causes.size(); ++k) {
      along[static_cast<Eigen::Index>(k)] = along_[index_of(causes[k])];
    }
    if (causes.empty()) return along;
    return matrix(causes).ldlt().solve(along);
  }
  static Deviations spread(const std::vector<Deviation>& causes, const Eigen::VectorXd& values) {
    Deviations all = Deviations::Zero();
    for (std::size_t k = 0; k < causes.size(); ++k) {
      all[index_of(causes[k])] = values[static_cast<Eigen::Index>(k)];
    }
    return all;
  }

  Deviations steps_, prior_, least_;  ///< The last two in steps.
  DeviationLimits limits_;
  Eigen::MatrixXd products_;
  Deviations along_;
  double square_ = 0.0;
  double variance_ = 0.0;     ///< Of a pixel, times τ.
  double independent_ = 0.0;  ///< N / τ
  std::vector<Deviation> showing_;
};

/// Values of a fit's active deviations, in steps.
Eigen::VectorXd active_values(const DeviationFit& fit) {
  Eigen::VectorXd values(std::ssize(fit.active()));
  for (std::size_t k = 0; k < fit.active().size(); ++k) {
    const Eigen::Index i = index_of(fit.active()[k]);
    values[static_cast<Eigen::Index>(k)] = fit.deviations()[i] / fit.steps()[i];
  }
  return values;
}

/// Evidence, standard error and alternatives of an active deviation.
FoundCause described(const DeviationFit& fit, const JointTest& test, Deviation deviation) {
  const std::vector<Deviation>& active = fit.active();
  const double with = test.evidence(active);
  std::vector<Deviation> others = active;
  std::erase(others, deviation);
  FoundCause cause;
  cause.deviation = deviation;
  cause.value = fit.deviations()[index_of(deviation)];
  cause.error = test.error(active, deviation);
  cause.evidence = with - test.evidence(others);
  for (const Deviation d : test.showing()) {
    if (std::find(active.begin(), active.end(), d) != active.end()) continue;
    std::vector<Deviation> instead = others;
    instead.push_back(d);
    if ((scales_throw(d) && scales_throw(deviation)) ||
        test.evidence_if_named(instead) > with - kAlike) {
      cause.alternatives.push_back(d);
    }
  }
  return cause;
}

/// Drops what is below the least that is named; true if there was any.
bool drop_least(DeviationFit& fit) {
  const Deviations least = least_named(fit.steps());
  std::vector<Deviation> kept = fit.active();
  const auto dropped = std::erase_if(kept, [&](Deviation d) {
    return std::abs(fit.deviations()[index_of(d)]) < least[index_of(d)];
  });
  fit.activate(kept);
  return dropped > 0;
}

Deviations standard_errors(const DeviationFit& fit, const JointTest& test) {
  Deviations errors = Deviations::Zero();
  for (const Deviation d : test.showing()) {
    std::vector<Deviation> causes = fit.active();
    if (std::find(causes.begin(), causes.end(), d) == causes.end()) causes.push_back(d);
    errors[index_of(d)] = test.error(causes, d);
  }
  return errors;
}

}  // namespace

WallPicture wall_picture(const WallModel& model, const Deviations& deviations) {
  return {model.picture(deviations), model.margin() * model.fine()};
}

Deviations prior_of(const WallModel& model) {
  const Deviations steps = deviation_steps(model.lens().setup);
  Deviations prior;
  prior << 0.03, 0.05, 0.05, 4.0 * steps[index_of(Deviation::kLampSize)], 0.01, 0.003, 0.3, 0.1,
      0.005, 0.1;
  return prior;
}

CauseFit find_causes(const WallModel& model, const SeenPixels& pixels, const Eigen::VectorXd& view,
                     const RunControl& control) {
  DeviationFit fit(model, pixels, view, control);
  fit.run();
  const double without = fit.square();
  const Deviations prior = prior_of(model);
  JointTest test(fit, prior);
  CauseFit result;
  result.unexplained = std::sqrt(fit.square() / fit.samples());
  for (int search = 0; search < kMostSearches; ++search) {
    const std::vector<Deviation> causes = test.best(std::min(search + 1, kMostCauses));
    if (causes == fit.active()) break;
    DeviationFit next = fit;
    next.activate(causes);
    next.run();
    if (drop_least(next)) next.run();
    const JointTest there(next, prior);
    const auto evidence = [&](const DeviationFit& of) {
      return there.gain(without, of.square()) - there.cost(of.active(), active_values(of));
    };
    if (!(evidence(next) > evidence(fit))) break;
    fit = next;
    test = there;
  }
  result.errors = standard_errors(fit, test);
  for (const Deviation d : fit.active()) result.found.push_back(described(fit, test, d));
  std::sort(result.found.begin(), result.found.end(),
            [](const FoundCause& a, const FoundCause& b) { return a.evidence > b.evidence; });
  result.view = fit.view();
  result.deviations = fit.deviations();
  result.residual = std::sqrt(fit.square() / fit.samples());
  return result;
}

}  // namespace lensforge
