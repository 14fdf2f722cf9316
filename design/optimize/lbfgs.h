// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"

namespace lensforge {

struct LbfgsOptions {
  int max_iterations = 100;
  int history = 8;  ///< Stored pairs of steps and gradient changes, ≥ 1.
  /// Stops when the value fell by less than this share of itself over `stall_window` iterations.
  double relative_decrease = 1e-4;
  int stall_window = 10;
  /// Constants of sufficient decrease and curvature in the weak Wolfe conditions (Nocedal & Wright,
  /// 3.6).
  double armijo = 1e-4;
  double wolfe = 0.9;
  int max_evaluations_per_step = 20;
};

struct LbfgsSummary {
  enum class Status { kConverged, kIterationLimit, kStopped, kNoDescent, kInfeasibleStart };
  Status status = Status::kIterationLimit;
  std::string message;  ///< Reason for the end, in one line.
  double initial_value = 0.0;
  double value = 0.0;
  int iterations = 0;
  int evaluations = 0;

  [[nodiscard]] bool converged() const { return status == Status::kConverged; }
};

/// Called after every accepted step with the step's number; returning false ends the minimisation.
using LbfgsObserver = std::function<bool(int iteration, double value)>;

// Kernels of the minimiser's vector operations, for one entry.

/// Entries per task of a vector operation.
inline constexpr std::int64_t kVectorGrain = 16384;

/// y ← x + a d
struct StepEntry {
  const double* x;
  double a;
  const double* d;
  double* y;
  LF_HD void operator()(std::int64_t i) const { y[i] = a * d[i] + x[i]; }
};

/// y ← a − b
template <class T>
struct DifferenceEntry {
  const double* a;
  const double* b;
  T* y;
  LF_HD void operator()(std::int64_t i) const { y[i] = static_cast<T>(a[i] - b[i]); }
};

/// x ← a x
struct ScaleEntry {
  double a;
  double* x;
  LF_HD void operator()(std::int64_t i) const { x[i] *= a; }
};

/// Number of vectors that one pass over memory handles together.
inline constexpr std::size_t kVectorGroup = 4;
using VectorGroup = std::array<const float*, kVectorGroup>;

/// Products of v with each vector of a group.
template <class T>
struct GroupProducts {
  VectorGroup group;
  const T* v;
  LF_HD std::array<double, kVectorGroup> operator()(std::int64_t i) const {
    const double factor = v[i];
    std::array<double, kVectorGroup> items;
    for (std::size_t k = 0; k < kVectorGroup; ++k) items[k] = factor * group[k][i];
    return items;
  }
};

/// s·y, s·s and y·y.
struct CurvatureEntry {
  const float* s;
  const float* y;
  LF_HD std::array<double, 3> operator()(std::int64_t i) const {
    const double step = s[i];
    const double change = y[i];
    return {step * change, step * step, change * change};
  }
};

/// y ← x + Σ a v over a group.
struct AddGroup {
  VectorGroup group;
  std::array<double, kVectorGroup> a;
  const double* x;
  double* y;
  LF_HD void operator()(std::int64_t i) const {
    double sum = x[i];
    for (std::size_t k = 0; k < kVectorGroup; ++k) sum += a[k] * group[k][i];
    y[i] = sum;
  }
};

/// The latest steps s of a minimisation with the gradient changes y, and the two loops of
/// limited-memory BFGS over these pairs (Nocedal & Wright, algorithm 7.4). With stored sᵢ·yⱼ each
/// loop reads its vectors only twice, several per pass. Vectors are rounded to single precision
/// before any product is computed, so the matrix stays positive definite.
template <class Exec>
class CurvaturePairsOn {
 public:
  using Vector = typename Exec::template Buffer<double>;

  /// @param most  maximum number of pairs, ≥ 1.
  CurvaturePairsOn(const Exec& executor, int most)
      : executor_(executor), most_(static_cast<std::size_t>(most)) {}

  [[nodiscard]] bool empty() const { return pairs_.empty(); }
  void clear() {
    for (Pair& pair : pairs_) spare_.push_back(std::move(pair));
    pairs_.clear();
  }

  /// Adds s = to.x − from.x and y = to.gradient − from.gradient, in place of the oldest pair if
  /// there are too many. @return s·y; 0, and adds nothing, unless it is above kCurvatureFloor ×
  /// |s||y|.
  template <class Point>
  double add(const Point& from, const Point& to);

  /// q ← g − Σ αᵢ yᵢ
  void first_loop(const Vector& g, Vector& q);
  /// r ← r + Σ (αᵢ − βᵢ) sᵢ, r = H₀ q. @pre the first loop was the last call.
  void second_loop(Vector& r);

 private:
  using Floats = typename Exec::template Buffer<float>;

  struct Pair {
    Floats s, y;
    double curvature = 0.0;        ///< s·y
    std::vector<double> products;  ///< sᵢ·y with the earlier steps, oldest first.
  };
  using Member = Floats Pair::*;

  /// Pairs with s·y below this share of |s||y| are rejected: they make the matrix ill-conditioned.
  static constexpr double kCurvatureFloor = 1e-12;

  [[nodiscard]] Pair free_pair(std::size_t size);
  [[nodiscard]] VectorGroup group(Member member, std::size_t first) const;
  template <class Values>
  [[nodiscard]] std::vector<double> products(Member member, const Values& v) const;
  void combine(Member member, const std::vector<double>& a, const Vector& from, Vector& to) const;

  Exec executor_;
  std::size_t most_;
  std::vector<Pair> pairs_;  ///< Oldest first.
  std::vector<Pair> spare_;  ///< Vectors for reuse.
  std::vector<double> alpha_;
};

template <class Exec>
typename CurvaturePairsOn<Exec>::Pair CurvaturePairsOn<Exec>::free_pair(std::size_t size) {
  if (spare_.empty()) return {Floats(size), Floats(size), 0.0, {}};
  Pair pair = std::move(spare_.back());
  spare_.pop_back();
  return pair;
}

/// Vectors of kVectorGroup pairs from `first` on; if there are fewer, the last one is repeated.
template <class Exec>
VectorGroup CurvaturePairsOn<Exec>::group(Member member, std::size_t first) const {
  VectorGroup vectors;
  for (std::size_t k = 0; k < kVectorGroup; ++k) {
    vectors[k] = (pairs_[std::min(first + k, pairs_.size() - 1)].*member).data();
  }
  return vectors;
}

/// Products of each pair's vector with v.
template <class Exec>
template <class Values>
std::vector<double> CurvaturePairsOn<Exec>::products(Member member, const Values& v) const {
  using Entry = std::remove_cv_t<std::remove_pointer_t<decltype(v.data())>>;
  const auto size = static_cast<std::int64_t>(v.size());
  std::vector<typename Exec::template PendingSum<kVectorGroup>> sums;
  for (std::size_t first = 0; first < pairs_.size(); first += kVectorGroup) {
    sums.push_back(pending_sum<kVectorGroup>(executor_, "products", size,
                                             GroupProducts<Entry>{group(member, first), v.data()}));
  }
  std::vector<double> result(pairs_.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = sums[i / kVectorGroup].get()[i % kVectorGroup];
  }
  return result;
}

/// to ← from + Σ a v over the pairs' vectors.
template <class Exec>
void CurvaturePairsOn<Exec>::combine(Member member, const std::vector<double>& a,
                                     const Vector& from, Vector& to) const {
  const double* start = from.data();
  for (std::size_t first = 0; first < pairs_.size(); first += kVectorGroup) {
    AddGroup add{group(member, first), {}, start, to.data()};
    const std::size_t count = std::min(kVectorGroup, pairs_.size() - first);
    std::copy_n(a.begin() + static_cast<std::ptrdiff_t>(first), count, add.a.begin());
    parallel_for(executor_, "combine", static_cast<std::int64_t>(to.size()), add, kVectorGrain);
    start = to.data();
  }
}

template <class Exec>
template <class Point>
double CurvaturePairsOn<Exec>::add(const Point& from, const Point& to) {
  const auto size = static_cast<std::int64_t>(from.x.size());
  Pair pair = free_pair(from.x.size());
  parallel_for(executor_, "difference", size,
               DifferenceEntry<float>{to.x.data(), from.x.data(), pair.s.data()}, kVectorGrain);
  parallel_for(executor_, "difference", size,
               DifferenceEntry<float>{to.gradient.data(), from.gradient.data(), pair.y.data()},
               kVectorGrain);
  const auto [curvature, ss, yy] =
      pending_sum<3>(executor_, "curvature", size, CurvatureEntry{pair.s.data(), pair.y.data()})
          .get();
  if (!(curvature > kCurvatureFloor * std::sqrt(ss * yy))) {
    spare_.push_back(std::move(pair));
    return 0.0;
  }
  if (pairs_.size() == most_) {
    spare_.push_back(std::move(pairs_.front()));
    pairs_.erase(pairs_.begin());
    for (Pair& kept : pairs_) kept.products.erase(kept.products.begin());
  }
  pair.curvature = curvature;
  pair.products = products(&Pair::s, pair.y);
  pairs_.push_back(std::move(pair));
  return curvature;
}

template <class Exec>
void CurvaturePairsOn<Exec>::first_loop(const Vector& g, Vector& q) {
  alpha_ = products(&Pair::s, g);
  for (std::size_t i = pairs_.size(); i-- > 0;) {
    for (std::size_t j = i + 1; j < pairs_.size(); ++j) {
      alpha_[i] -= alpha_[j] * pairs_[j].products[i];
    }
    alpha_[i] /= pairs_[i].curvature;
  }
  std::vector<double> a = alpha_;
  for (double& share : a) share = -share;
  combine(&Pair::y, a, g, q);
}

template <class Exec>
void CurvaturePairsOn<Exec>::second_loop(Vector& r) {
  const std::vector<double> along = products(&Pair::y, r);
  std::vector<double> a(pairs_.size());
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    double beta = along[i];
    for (std::size_t j = 0; j < i; ++j) beta += a[j] * pairs_[i].products[j];
    a[i] = alpha_[i] - beta / pairs_[i].curvature;
  }
  combine(&Pair::s, a, r, r);
}

/// Computes value and gradient of a function at x, in an executor's memory. An infinite value means
/// that x is not allowed; the gradient is then not read.
using RawObjective = std::function<double(std::span<const double> x, std::span<double> gradient)>;

/// Symmetric positive definite approximation of the inverse Hessian, in an executor's memory: r ← P
/// g.
using RawPreconditioner = std::function<void(std::span<const double> g, std::span<double> r)>;

/// Limited-memory BFGS (Liu & Nocedal 1989) with a preconditioner as initial matrix and a line
/// search that meets the weak Wolfe conditions by bisection (Lewis & Overton 2013), stepping back
/// where the value is infinite, at first by a parabola. All vectors stay in the executor's memory;
/// only scalar products leave it. Sums have a fixed order, so the result does not depend on the
/// thread count.
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

  /// Moves `x` to the best point found, also if an exception ends the run.
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

  /// Evaluations per step after which a lower value is accepted without the curvature condition.
  static constexpr int kEnoughEvaluations = 4;

  /// Factors on a step that was too long: on one that is not allowed, minimum and maximum.
  static constexpr double kShorterIfRefused = 0.25;
  static constexpr double kShortest = 0.05;
  static constexpr double kLongest = 0.5;

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
  [[nodiscard]] double shortened(double step, double slope, double value) const;
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
  double scale_ = 1.0;  ///< Scale of the initial matrix.
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

/// A first step, by steepest descent, shorter than one that was too long, which may be by a hundred
/// times: to the minimum of the parabola through the values at both its ends and the slope at the
/// first, within a twentieth and a half of it. Later ones are halved: barriers are no parabolas,
/// and steps that are too short keep a design where it is.
template <class Exec>
double LbfgsOn<Exec>::shortened(double step, double slope, double value) const {
  if (!std::isfinite(value)) return kShorterIfRefused * step;
  const double bend = value - current_.value - step * slope;
  return std::clamp(-0.5 * step * slope / bend, kShortest, kLongest) * step;
}

/// The weak Wolfe line search along direction_ from current_; next_ receives the accepted point.
/// @return number of points looked at; `decreased` is true if one of sufficient decrease was found.
template <class Exec>
int LbfgsOn<Exec>::search(double slope, bool& decreased) {
  double low = 0.0;
  double high = std::numeric_limits<double>::infinity();
  double step = 1.0;
  decreased = false;
  for (int evaluations = 0; evaluations < options_.max_evaluations_per_step;) {
    each_entry("step", StepEntry{current_.x.data(), step, direction_.data(), trial_.x.data()});
    evaluate(trial_);
    const double tried = trial_.value;
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
    if (evaluations % kEnoughEvaluations == 0) {
      // Looks at other points may have changed what the objective says of this one (NodeWaves).
      evaluate(current_);
      slope = product(direction_, current_.gradient);
      if (!(slope < 0.0)) return evaluations;
    }
    if (std::isinf(high)) {
      step *= 2.0;
    } else {
      step = low == 0.0 && pairs_.empty() ? shortened(high, slope, tried) : 0.5 * (low + high);
    }
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
