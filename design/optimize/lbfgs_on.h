// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "design/optimize/curvature_pairs_on.h"
#include "design/optimize/lbfgs.h"
#include "design/optimize/vector_kernels.h"

namespace lensforge {

/// Value and gradient of a function at x, in an executor's memory. An infinite value means that x
/// is not allowed; the gradient is then not read.
using RawObjective = std::function<double(std::span<const double> x, std::span<double> gradient)>;

/// A symmetric positive definite guess of the inverse Hessian, in an executor's memory: r ← P g.
using RawPreconditioner = std::function<void(std::span<const double> g, std::span<double> r)>;

/// Limited-memory BFGS (Liu & Nocedal 1989) with a preconditioner as initial matrix and a line
/// search that meets the weak Wolfe conditions by bisection (Lewis & Overton 2013), stepping back
/// where the value is infinite. All vectors stay in the executor's memory, only scalar products
/// leave it. Sums run in fixed order: the path does not depend on the thread count.
template <class Exec>
class LbfgsOn {
 public:
  using Vector = typename Exec::template Buffer<double>;

  LbfgsOn(RawObjective objective, RawPreconditioner precondition, const LbfgsOptions& options,
          const Exec& executor)
      : objective_(std::move(objective)),
        precondition_(std::move(precondition)),
        options_(options),
        executor_(executor),
        pairs_(executor, options.history) {}

  /// Moves `x` to the best point found, also where an exception ends the run.
  LbfgsSummary run(const LbfgsObserver& observe, Vector& x) {
    current_ = Point(x.size());
    current_.x.swap(x);
    try {
      LbfgsSummary summary = minimize(observe);
      current_.x.swap(x);
      return summary;
    } catch (...) {
      current_.x.swap(x);
      throw;
    }
  }

 private:
  using Status = LbfgsSummary::Status;

  /// A point with its value and gradient.
  struct Point {
    Vector x;
    Vector gradient;
    double value = std::numeric_limits<double>::infinity();

    Point() = default;
    explicit Point(std::size_t size) : x(size), gradient(size) {}
  };

  /// Once the value has fallen, the curvature condition is worth only so many evaluations.
  static constexpr int kEnoughEvaluations = 4;

  template <class Functor>
  void each_entry(const char* kernel, const Functor& functor) const {
    parallel_for(executor_, kernel, static_cast<std::int64_t>(current_.x.size()), functor,
                 kVectorGrain);
  }
  [[nodiscard]] double product(const Vector& a, const Vector& b) const {
    return dot(executor_, {a.data(), a.size()}, {b.data(), b.size()});
  }
  void precondition(const Vector& g, Vector& r) {
    precondition_({g.data(), g.size()}, {r.data(), r.size()});
  }
  void evaluate(Point& point) {
    point.value = objective_({point.x.data(), point.x.size()},
                             {point.gradient.data(), point.gradient.size()});
  }

  LbfgsSummary minimize(const LbfgsObserver& observe);
  void find_direction();
  int search(double slope, bool& decreased);
  void remember();
  [[nodiscard]] bool stalled(const std::vector<double>& values) const;

  RawObjective objective_;
  RawPreconditioner precondition_;
  LbfgsOptions options_;
  Exec executor_;

  Point current_;
  Point trial_;
  Point next_;
  Vector direction_;
  Vector work_;
  CurvaturePairsOn<Exec> pairs_;
  double scale_ = 1.0;  ///< Of the initial matrix.
};

/// direction ← −H g by the two-loop recursion.
template <class Exec>
void LbfgsOn<Exec>::find_direction() {
  if (pairs_.empty()) {
    precondition(current_.gradient, direction_);
  } else {
    pairs_.first_loop(current_.gradient, work_);
    precondition(work_, direction_);
    each_entry("scale", ScaleEntry{scale_, direction_.data()});
    pairs_.second_loop(direction_);
  }
  each_entry("scale", ScaleEntry{-1.0, direction_.data()});
}

/// Adds the pair of the step from current_ to next_.
template <class Exec>
void LbfgsOn<Exec>::remember() {
  const double curvature = pairs_.add(current_, next_);
  if (curvature == 0.0) return;
  // γ = s·y / y·Py scales the initial matrix to the newest curvature (Nocedal & Wright, 7.20).
  Vector& change = work_;
  Vector& preconditioned = direction_;
  each_entry("difference", DifferenceEntry<double>{next_.gradient.data(), current_.gradient.data(),
                                                   change.data()});
  precondition(change, preconditioned);
  scale_ = curvature / product(change, preconditioned);
}

/// The weak Wolfe line search along direction_ from current_; next_ receives the accepted point.
/// @return evaluations spent; `decreased` tells whether a point of sufficient decrease was found.
template <class Exec>
int LbfgsOn<Exec>::search(double slope, bool& decreased) {
  double low = 0.0;
  double high = std::numeric_limits<double>::infinity();
  double step = 1.0;
  decreased = false;
  for (int evaluations = 0; evaluations < options_.max_evaluations_per_step;) {
    each_entry("step", StepEntry{current_.x.data(), step, direction_.data(), trial_.x.data()});
    evaluate(trial_);
    ++evaluations;
    if (!(trial_.value <= current_.value + options_.armijo * step * slope)) {
      high = step;
    } else {
      const bool flat = product(trial_.gradient, direction_) >= options_.wolfe * slope;
      std::swap(next_, trial_);
      decreased = true;
      if (flat) return evaluations;
      low = step;
    }
    if (decreased && evaluations >= kEnoughEvaluations) return evaluations;
    step = std::isinf(high) ? 2.0 * step : 0.5 * (low + high);
  }
  return options_.max_evaluations_per_step;
}

/// True if the value has stopped falling over the window.
template <class Exec>
bool LbfgsOn<Exec>::stalled(const std::vector<double>& values) const {
  const auto window = static_cast<std::size_t>(options_.stall_window);
  if (values.size() <= window) return false;
  const double before = values[values.size() - 1 - window];
  return before - values.back() <= options_.relative_decrease * std::fabs(before);
}

template <class Exec>
LbfgsSummary LbfgsOn<Exec>::minimize(const LbfgsObserver& observe) {
  LbfgsSummary summary;
  const auto finish = [&](Status status, const char* message) {
    summary.status = status;
    summary.message = message;
    return summary;
  };
  evaluate(current_);
  summary.evaluations = 1;
  summary.initial_value = summary.value = current_.value;
  if (!std::isfinite(current_.value)) {
    return finish(Status::kInfeasibleStart, "the start breaks a barrier");
  }
  const std::size_t size = current_.x.size();
  trial_ = Point(size);
  next_ = Point(size);
  direction_ = Vector(size);
  work_ = Vector(size);
  std::vector<double> values{current_.value};
  while (summary.iterations < options_.max_iterations) {
    find_direction();
    const double slope = product(direction_, current_.gradient);
    bool found = false;
    if (slope < 0.0) summary.evaluations += search(slope, found);
    if (!found) {
      if (pairs_.empty()) return finish(Status::kNoDescent, "no step lowers the value");
      pairs_.clear();
      continue;
    }
    ++summary.iterations;
    remember();
    std::swap(current_, next_);
    summary.value = current_.value;
    values.push_back(current_.value);
    if (!observe(summary.iterations, current_.value)) {
      return finish(Status::kStopped, "stopped by the caller");
    }
    if (stalled(values)) return finish(Status::kConverged, "the value has stopped falling");
  }
  return finish(Status::kIterationLimit, "reached the iteration limit");
}

}  // namespace lensforge
