// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/optimize/lbfgs.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <deque>
#include <limits>
#include <vector>

namespace lensforge {

namespace {

/// Entries that one task of a vector operation handles.
constexpr std::int64_t kVectorBlock = 16384;

/// Curvature pairs with s·y below this share of |s||y| are dropped: they would spoil the matrix.
constexpr double kCurvatureFloor = 1e-12;

double dot(const Executor& executor, const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const std::int64_t blocks = (a.size() + kVectorBlock - 1) / kVectorBlock;
  const auto block = [&](std::int64_t i) {
    const Eigen::Index begin = i * kVectorBlock;
    const Eigen::Index length = std::min<Eigen::Index>(kVectorBlock, a.size() - begin);
    return std::array<double, 1>{a.segment(begin, length).dot(b.segment(begin, length))};
  };
  return parallel_sum<1>(executor, "dot", blocks, block, 1)[0];
}

/// y ← a x + b y
void combine(const Executor& executor, double a, const Eigen::VectorXd& x, double b,
             Eigen::VectorXd& y) {
  const std::int64_t blocks = (x.size() + kVectorBlock - 1) / kVectorBlock;
  parallel_for(
      executor, "combine", blocks,
      [&](std::int64_t i) {
        const Eigen::Index begin = i * kVectorBlock;
        const Eigen::Index length = std::min<Eigen::Index>(kVectorBlock, x.size() - begin);
        y.segment(begin, length) = a * x.segment(begin, length) + b * y.segment(begin, length);
      },
      1);
}

/// The last steps s, gradient changes y and 1/(s·y); applies the inverse Hessian they imply.
class History {
 public:
  History(int limit, const Preconditioner& precondition, const Executor& executor)
      : limit_(static_cast<std::size_t>(limit)), precondition_(precondition), executor_(executor) {}

  /// Two-loop recursion: r ← H g.
  void apply(const Eigen::VectorXd& g, Eigen::VectorXd& r) {
    work_ = g;
    std::vector<double> alpha(pairs_.size());
    for (std::size_t i = pairs_.size(); i-- > 0;) {
      alpha[i] = pairs_[i].inverse_curvature * dot(executor_, pairs_[i].s, work_);
      combine(executor_, -alpha[i], pairs_[i].y, 1.0, work_);
    }
    precondition_(work_, r);
    if (!pairs_.empty()) r *= scale_;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const double beta = pairs_[i].inverse_curvature * dot(executor_, pairs_[i].y, r);
      combine(executor_, alpha[i] - beta, pairs_[i].s, 1.0, r);
    }
  }

  void add(Eigen::VectorXd s, Eigen::VectorXd y) {
    const double curvature = dot(executor_, s, y);
    const double floor = kCurvatureFloor * std::sqrt(dot(executor_, s, s) * dot(executor_, y, y));
    if (!(curvature > floor)) return;
    // γ = s·y / y·Py scales the initial matrix to the newest curvature (Nocedal & Wright, 7.20).
    precondition_(y, work_);
    scale_ = curvature / dot(executor_, y, work_);
    if (pairs_.size() == limit_) pairs_.pop_front();
    pairs_.push_back({std::move(s), std::move(y), 1.0 / curvature});
  }

  void clear() { pairs_.clear(); }
  [[nodiscard]] bool empty() const { return pairs_.empty(); }

 private:
  struct Pair {
    Eigen::VectorXd s, y;
    double inverse_curvature;
  };

  std::size_t limit_;
  const Preconditioner& precondition_;
  const Executor& executor_;
  std::deque<Pair> pairs_;
  Eigen::VectorXd work_;
  double scale_ = 1.0;
};

/// A point with its value and gradient.
struct Point {
  Eigen::VectorXd x;
  Eigen::VectorXd gradient;
  double value = std::numeric_limits<double>::infinity();
};

/// The weak Wolfe line search along `direction` from `from`; `to` receives the accepted point.
class LineSearch {
 public:
  LineSearch(const Objective& objective, const LbfgsOptions& options, const Executor& executor)
      : objective_(objective), options_(options), executor_(executor) {}

  /// Number of evaluations spent in the last run().
  int evaluations = 0;

  /// @return whether a point of sufficient decrease was found.
  bool run(const Point& from, const Eigen::VectorXd& direction, double slope, Point& to) {
    double low = 0.0;
    double high = std::numeric_limits<double>::infinity();
    double step = 1.0;
    bool decreased = false;
    Point trial;
    for (evaluations = 0; evaluations < options_.max_evaluations_per_step;) {
      trial.x = from.x;
      combine(executor_, step, direction, 1.0, trial.x);
      trial.value = objective_(trial.x, trial.gradient);
      ++evaluations;
      if (!(trial.value <= from.value + options_.armijo * step * slope)) {
        high = step;
      } else {
        const bool flat = dot(executor_, trial.gradient, direction) >= options_.wolfe * slope;
        std::swap(to, trial);
        decreased = true;
        if (flat) return true;
        low = step;
      }
      if (decreased && evaluations >= kEnoughEvaluations) return true;
      step = std::isinf(high) ? 2.0 * step : 0.5 * (low + high);
    }
    return decreased;
  }

 private:
  /// Once the value has fallen, the curvature condition is worth only so many evaluations.
  static constexpr int kEnoughEvaluations = 4;

  const Objective& objective_;
  const LbfgsOptions& options_;
  const Executor& executor_;
};

/// True if the value has stopped falling over the window.
bool stalled(const std::vector<double>& values, const LbfgsOptions& options) {
  const auto window = static_cast<std::size_t>(options.stall_window);
  if (values.size() <= window) return false;
  const double before = values[values.size() - 1 - window];
  return before - values.back() <= options.relative_decrease * std::fabs(before);
}

LbfgsSummary& finish(LbfgsSummary& summary, LbfgsSummary::Status status, const char* message) {
  summary.status = status;
  summary.message = message;
  return summary;
}

}  // namespace

LbfgsSummary minimize_lbfgs(const Objective& objective, const Preconditioner& precondition,
                            const LbfgsOptions& options, const LbfgsObserver& observe,
                            const Executor& executor, Eigen::VectorXd& x) {
  using Status = LbfgsSummary::Status;
  LbfgsSummary summary;
  Point current{x, {}, 0.0};
  current.value = objective(current.x, current.gradient);
  summary.evaluations = 1;
  summary.initial_value = summary.value = current.value;
  if (!std::isfinite(current.value)) {
    return finish(summary, Status::kInfeasibleStart, "the start breaks a barrier");
  }
  History history(options.history, precondition, executor);
  LineSearch search(objective, options, executor);
  std::vector<double> values{current.value};
  Eigen::VectorXd direction(x.size());
  while (summary.iterations < options.max_iterations) {
    history.apply(current.gradient, direction);
    direction *= -1.0;
    const double slope = dot(executor, direction, current.gradient);
    Point next;
    const bool found = slope < 0.0 && search.run(current, direction, slope, next);
    if (slope < 0.0) summary.evaluations += search.evaluations;
    if (!found) {
      if (history.empty()) return finish(summary, Status::kNoDescent, "no step lowers the value");
      history.clear();
      continue;
    }
    ++summary.iterations;
    history.add(next.x - current.x, next.gradient - current.gradient);
    std::swap(current, next);
    x = current.x;
    summary.value = current.value;
    values.push_back(current.value);
    if (!observe(summary.iterations, current.value)) {
      return finish(summary, Status::kStopped, "stopped by the caller");
    }
    if (stalled(values, options)) {
      return finish(summary, Status::kConverged, "the value has stopped falling");
    }
  }
  return finish(summary, Status::kIterationLimit, "reached the iteration limit");
}

}  // namespace lensforge
