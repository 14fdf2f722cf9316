// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/causes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "core/error.h"

namespace lensforge {
namespace {

/// Evidence below which a cause is not named.
constexpr double kEvidence = 60.0;
/// Evidence that an alternative may lack.
constexpr double kAlike = 12.0;
/// Share of its effect that a further cause must not have in common with those before: distance and
/// index differ by less, and would only be weighed against each other.
constexpr double kOwnShare = 0.05;
constexpr std::size_t kMostCauses = 4;
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
      : model_(model),
        pixels_(pixels),
        control_(control),
        steps_(deviation_steps(model.lens().setup)),
        limits_(deviation_limits(model.lens().setup)),
        view_(std::move(view)) {
    at_.setZero();
  }

  [[nodiscard]] const Eigen::VectorXd& view() const { return view_; }
  [[nodiscard]] const Deviations& deviations() const { return at_; }
  [[nodiscard]] const std::vector<Deviation>& active() const { return active_; }
  [[nodiscard]] double square() const { return square_; }
  [[nodiscard]] double samples() const { return static_cast<double>(pixels_.size()); }

  void activate(Deviation deviation) { active_.push_back(deviation); }
  void drop(Deviation deviation) {
    std::erase(active_, deviation);
    at_[index_of(deviation)] = 0.0;
  }
  /// Fits view and active deviations.
  void run();

  /// What view and deviations change, to first order, around the fit.
  struct Tangents {
    Eigen::VectorXd residuals;
    Eigen::MatrixXd view;
    Eigen::MatrixXd columns;  ///< One per deviation and step of it; 0 for those that do not show.

    /// The same less what the view and these deviations could change as well.
    [[nodiscard]] Tangents beyond(const std::vector<Deviation>& known) const;
  };
  [[nodiscard]] Tangents tangents() const;
  [[nodiscard]] const Deviations& steps() const { return steps_; }

 private:
  [[nodiscard]] WallPicture wall(const Deviations& at) const {
    if (control_.stop_requested()) throw Interrupted();
    return wall_picture(model_, at);
  }
  /// Change of the picture by one step.
  [[nodiscard]] Image change(Deviation deviation, const Image& from) const;

  const WallModel& model_;
  const SeenPixels& pixels_;
  const RunControl& control_;
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
      return Eigen::VectorXd(pixels_.shown(p.head(view::kCount), moved(p)) - pixels_.seen());
    };
    problem.derivatives = [&](const Eigen::VectorXd& p) {
      const WallPicture now = moved(p);
      const Eigen::VectorXd view = p.head(view::kCount);
      const Eigen::VectorXd shown = pixels_.shown(view, now);
      Eigen::MatrixXd rows = pixels_.derivatives(view, now);
      rows.conservativeResize(Eigen::NoChange, count);
      for (std::size_t k = 0; k < changes.size(); ++k) {
        constexpr double kStep = 0.1;
        const WallPicture beyond{sum_of(now.light, kStep, changes[k]), now.margin};
        rows.col(view::kCount + static_cast<Eigen::Index>(k)) =
            (pixels_.shown(view, beyond) - shown) / kStep;
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
  square_ = (pixels_.shown(view_, wall(at_)) - pixels_.seen()).squaredNorm();
}

DeviationFit::Tangents DeviationFit::tangents() const {
  const WallPicture base = wall(at_);
  const Eigen::VectorXd shown = pixels_.shown(view_, base);
  Tangents result{pixels_.seen() - shown, pixels_.derivatives(view_, base),
                  Eigen::MatrixXd::Zero(shown.size(), static_cast<int>(kDeviations))};
  for (std::size_t k = 0; k < kDeviations; ++k) {
    const auto d = static_cast<Deviation>(k);
    if (!model_.shows(d)) continue;
    const WallPicture moved{sum_of(base.light, 1.0, change(d, base.light)), base.margin};
    result.columns.col(static_cast<Eigen::Index>(k)) = pixels_.shown(view_, moved) - shown;
  }
  return result;
}

DeviationFit::Tangents DeviationFit::Tangents::beyond(const std::vector<Deviation>& known) const {
  Eigen::MatrixXd basis(view.rows(), view.cols() + std::ssize(known));
  basis.leftCols(view.cols()) = view;
  for (std::size_t k = 0; k < known.size(); ++k) {
    basis.col(view.cols() + static_cast<Eigen::Index>(k)) = columns.col(index_of(known[k]));
  }
  for (Eigen::Index k = 0; k < basis.cols(); ++k) basis.col(k).normalize();
  basis = Eigen::HouseholderQR<Eigen::MatrixXd>(basis).householderQ() *
          Eigen::MatrixXd::Identity(basis.rows(), basis.cols());
  Tangents rest = *this;
  rest.columns -= basis * (basis.transpose() * columns);
  rest.residuals -= basis * (basis.transpose() * residuals);
  return rest;
}

/// Best value, in steps, and evidence of a deviation, to first order.
struct Score {
  double value = 0.0;
  double evidence = 0.0;
};

constexpr double kFaintest = 1e-6;  ///< Change per step of a display value, rms, that counts as 0.

Score score_of(const Eigen::VectorXd& residuals, const Eigen::VectorXd& column) {
  const double square = column.squaredNorm();
  const auto count = static_cast<double>(residuals.size());
  if (square < kFaintest * kFaintest * count) return {};
  const double along = column.dot(residuals);
  const double all = residuals.squaredNorm();
  return {along / square, count * -std::log(1.0 - std::min(along * along / square / all, 0.999))};
}

/// Smaller deviations are not named: neither are cameras and predictions better.
Deviations least_named(const Deviations& steps) {
  Deviations least;
  least << 0.004, 0.012, 0.012, 0.12 * steps[index_of(Deviation::kLampSize)], 0.004, 0.003, 0.05,
      0.04, 0.0007, 0.02;
  return least;
}

/// The deviation with the most evidence; none if there is not enough.
/// @param refused  those that are not asked again.
std::optional<Deviation> next_cause(const DeviationFit& fit, const DeviationFit::Tangents& all,
                                    const Deviations& prior,
                                    const std::vector<Deviation>& refused) {
  const DeviationFit::Tangents alone = all.beyond({});
  const DeviationFit::Tangents tangents = all.beyond(fit.active());
  const Deviations least = least_named(fit.steps());
  const auto is_in = [](const std::vector<Deviation>& list, Deviation d) {
    return std::find(list.begin(), list.end(), d) != list.end();
  };
  std::optional<Deviation> best;
  double most = kEvidence;
  for (std::size_t k = 0; k < kDeviations; ++k) {
    const auto d = static_cast<Deviation>(k);
    const auto i = static_cast<Eigen::Index>(k);
    if (is_in(fit.active(), d) || is_in(refused, d)) continue;
    const double own = tangents.columns.col(i).squaredNorm();
    if (own < kOwnShare * alone.columns.col(i).squaredNorm()) continue;
    const Score score = score_of(tangents.residuals, tangents.columns.col(i));
    if (d == Deviation::kHaze && score.value < 0.0) continue;
    const double value = score.value * fit.steps()[i];
    if (std::abs(value) < least[i]) continue;
    const double far = value / prior[i];
    const double evidence = score.evidence - far * far;
    if (evidence <= most) continue;
    most = evidence;
    best = d;
  }
  return best;
}

/// Evidence, standard error and alternatives of an active deviation.
FoundCause described(const DeviationFit& fit, const DeviationFit::Tangents& all,
                     Deviation deviation) {
  std::vector<Deviation> others = fit.active();
  std::erase(others, deviation);
  const DeviationFit::Tangents tangents = all.beyond(others);
  const Eigen::Index i = index_of(deviation);
  const Eigen::VectorXd own = tangents.columns.col(i);
  const double variance = fit.square() / fit.samples();
  FoundCause cause;
  cause.deviation = deviation;
  cause.value = fit.deviations()[i];
  cause.error = fit.steps()[i] * std::sqrt(variance / own.squaredNorm());
  const double steps = cause.value / fit.steps()[i];
  cause.evidence = fit.samples() * std::log(1.0 + steps * steps * own.squaredNorm() / fit.square());
  // In its place another one explains the share cos² of what it does.
  for (std::size_t k = 0; k < kDeviations; ++k) {
    const auto other = static_cast<Eigen::Index>(k);
    const Eigen::VectorXd column = tangents.columns.col(other);
    const double length = column.norm() * own.norm();
    if (other == i || !(length > 0.0)) continue;
    const auto d = static_cast<Deviation>(k);
    if (std::find(fit.active().begin(), fit.active().end(), d) != fit.active().end()) continue;
    const double cosine = column.dot(own) / length;
    if ((1.0 - cosine * cosine) * cause.evidence < kAlike) cause.alternatives.push_back(d);
  }
  return cause;
}

Deviations standard_errors(const DeviationFit& fit, const DeviationFit::Tangents& all) {
  const DeviationFit::Tangents tangents = all.beyond(fit.active());
  Deviations errors = Deviations::Zero();
  const double variance = fit.square() / fit.samples();
  for (Eigen::Index i = 0; i < errors.size(); ++i) {
    const double square = tangents.columns.col(i).squaredNorm();
    if (square > kFaintest * kFaintest * fit.samples()) {
      errors[i] = fit.steps()[i] * std::sqrt(variance / square);
    }
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
  DeviationFit::Tangents tangents = fit.tangents();
  CauseFit result;
  result.unexplained = std::sqrt(fit.square() / fit.samples());
  result.errors = standard_errors(fit, tangents);
  const Deviations prior = prior_of(model);
  const Deviations least = least_named(fit.steps());
  std::vector<Deviation> refused;  // Those that later ones made superfluous.
  while (fit.active().size() < kMostCauses) {
    const std::optional<Deviation> next = next_cause(fit, tangents, prior, refused);
    if (!next) break;
    fit.activate(*next);
    fit.run();
    tangents = fit.tangents();
    for (const Deviation d : std::vector<Deviation>(fit.active())) {
      if (described(fit, tangents, d).evidence >= kEvidence &&
          std::abs(fit.deviations()[index_of(d)]) >= least[index_of(d)]) {
        continue;
      }
      fit.drop(d);
      refused.push_back(d);
      fit.run();
      tangents = fit.tangents();
    }
  }
  for (const Deviation d : fit.active()) result.found.push_back(described(fit, tangents, d));
  std::sort(result.found.begin(), result.found.end(),
            [](const FoundCause& a, const FoundCause& b) { return a.evidence > b.evidence; });
  result.view = fit.view();
  result.deviations = fit.deviations();
  result.residual = std::sqrt(fit.square() / fit.samples());
  return result;
}

}  // namespace lensforge
