// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/finish_raster.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>

#include "core/decimal_text.h"
#include "core/error.h"

namespace lensforge {
namespace {

// How the tolerance is shared out; what rounding leaves of its last eighth is spare.
constexpr double kSamplingShare = 0.25;  ///< Drop curve against the chord of two samples.
constexpr double kChordShare = 0.5;      ///< Samples against the moves that replace them.

/// Rows that are cut at the same time: a tenth of a second of work, so that a stop is heard.
constexpr std::int64_t kBatchRows = 16;

double to_resolution(double value, double resolution) {
  // Dividing by the inverse, a power of ten, gives the double next to the decimal number.
  const double inverse = std::round(1.0 / resolution);
  return std::round(value * inverse) / inverse;
}

/// The drop curve along one row, x → height of the tip, extended beyond the rim (RasterPlan).
class DropCurve {
 public:
  DropCurve(const DropCutter& cutter, const RasterPlan& plan, double y)
      : cutter_(cutter), plan_(plan), y_(y) {}

  Eigen::Vector2d sample(double x) {
    const Eigen::Vector2d p = held(Eigen::Vector2d(x, y_));
    last_ = cutter_.drop(p, last_);
    ++samples_;
    if (!last_.rests()) throw_nothing_under(p);
    return {x, last_.tip};
  }

  [[nodiscard]] std::int64_t samples() const { return samples_; }

 private:
  /// p, or where it is farther than reach() from the surface the nearest place that is not. The
  /// drop curve there is nowhere lower than at p, since that place is nearer to all of the surface.
  [[nodiscard]] Eigen::Vector2d held(const Eigen::Vector2d& p) const {
    const Eigen::Vector2d rim = p.cwiseMax(plan_.surface.min()).cwiseMin(plan_.surface.max());
    const double beyond = (p - rim).norm();
    return beyond > plan_.reach() ? rim + (p - rim) * (plan_.reach() / beyond) : p;
  }

  [[noreturn]] static void throw_nothing_under(const Eigen::Vector2d& p) {
    throw InputError("surface: nothing under the tool at x " + decimal_text(p.x(), 3) + " y " +
                     decimal_text(p.y(), 3) + " mm; it has to cover the whole lens");
  }

  const DropCutter& cutter_;
  const RasterPlan& plan_;
  double y_;
  CutterLocation last_;
  std::int64_t samples_ = 0;
};

using Profile = std::vector<Eigen::Vector2d>;

/// Appends what lies between `a` and `b`, both excluded, so that a crease between them is within
/// the sampling share of the path: with a kink at the part f of an interval the chord's middle is
/// off by min(f, 1 − f)/2 of the slope's jump, the worst place by f(1 − f), less than twice as
/// much.
void halve(DropCurve& curve, const RasterPlan& plan, const Eigen::Vector2d& a,
           const Eigen::Vector2d& b, Profile& out) {
  const double x = to_resolution(0.5 * (a.x() + b.x()), plan.options.resolution);
  if (x <= a.x() || x >= b.x()) return;
  const Eigen::Vector2d middle = curve.sample(x);
  const double part = (x - a.x()) / (b.x() - a.x());
  const double off = std::abs(middle.y() - (a.y() + part * (b.y() - a.y())));
  if (off <= 0.5 * kSamplingShare * plan.options.tolerance) return;
  halve(curve, plan, a, middle, out);
  out.push_back(middle);
  halve(curve, plan, middle, b, out);
}

Profile sample_evenly(DropCurve& curve, const RasterPlan& plan) {
  const double begin = plan.surface.min().x() - plan.radius;
  const double end = plan.surface.max().x() + plan.radius;
  Profile profile;
  profile.reserve(static_cast<std::size_t>(plan.samples));
  for (std::int64_t i = 0; i < plan.samples; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(plan.samples - 1);
    profile.push_back(
        curve.sample(to_resolution(begin + part * (end - begin), plan.options.resolution)));
  }
  return profile;
}

/// Halves the intervals beside a sample where the slope jumps. A jump Δ in an interval of length s
/// shows as second differences s·Δ in sum at its ends, at least half of it at one of them, and puts
/// the drop curve at most s·Δ/4 below the chord.
Profile refine(DropCurve& curve, const RasterPlan& plan, const Profile& even) {
  const double most = 2.0 * kSamplingShare * plan.options.tolerance;
  const auto bends = [&](std::size_t i) {
    if (i == 0 || i + 1 >= even.size()) return false;
    return std::abs(even[i - 1].y() - 2.0 * even[i].y() + even[i + 1].y()) > most;
  };
  Profile fine;
  fine.reserve(even.size() + even.size() / 4);
  for (std::size_t i = 0; i < even.size(); ++i) {
    fine.push_back(even[i]);
    if (i + 1 < even.size() && (bends(i) || bends(i + 1))) {
      halve(curve, plan, even[i], even[i + 1], fine);
    }
  }
  return fine;
}

/// The slopes that a chord from one sample may have: through the gates of the samples passed, and
/// close enough to the direction of every interval passed.
struct SlopeWindow {
  double low = -HUGE_VAL, high = HUGE_VAL;                ///< Rise over run.
  double least_angle = HUGE_VAL, most_angle = -HUGE_VAL;  ///< Of the intervals passed, rad.

  void pass_interval(const Eigen::Vector2d& step) {
    const double angle = std::atan2(step.y(), step.x());
    least_angle = std::min(least_angle, angle);
    most_angle = std::max(most_angle, angle);
  }
  void pass_sample(const Eigen::Vector2d& offset, double gate) {
    low = std::max(low, (offset.y() - gate) / offset.x());
    high = std::min(high, (offset.y() + gate) / offset.x());
  }
  [[nodiscard]] bool admits(const Eigen::Vector2d& offset, double slope_tolerance) const {
    const double slope = offset.y() / offset.x();
    if (slope < low || slope > high) return false;
    const double angle = std::atan(slope);
    return most_angle - angle <= slope_tolerance && angle - least_angle <= slope_tolerance;
  }
};

/// Greedy: every chord runs as far as the first sample that it could not reach within tolerance.
Profile simplify(const Profile& fine, const RasterOptions& options) {
  const double gate = kChordShare * options.tolerance;
  Profile kept{fine.front()};
  std::size_t from = 0;
  while (from + 1 < fine.size()) {
    SlopeWindow window;
    std::size_t reached = from + 1;
    for (std::size_t to = from + 1; to < fine.size(); ++to) {
      const Eigen::Vector2d offset = fine[to] - fine[from];
      window.pass_interval(fine[to] - fine[to - 1]);
      if (to > from + 1 && !window.admits(offset, options.slope_tolerance)) break;
      reached = to;
      window.pass_sample(offset, gate);
    }
    kept.push_back(fine[reached]);
    from = reached;
  }
  return kept;
}

void add_row(const RasterRow& row, Eigen::Vector3d& last, RasterSummary& summary) {
  for (const Eigen::Vector3d& point : row.points) {
    if (summary.points > 0) summary.length += (point - last).norm();
    ++summary.points;
    summary.tip.extend(point);
    last = point;
  }
  summary.samples += row.samples;
  ++summary.rows;
}

}  // namespace

double RasterPlan::reach() const { return radius / std::numbers::sqrt2; }

double RasterPlan::row_y(std::int64_t row) const {
  const double height = surface.sizes().y();
  const auto steps = static_cast<double>(rows - 1 - 2 * rows_outside);
  const double part = static_cast<double>(row - rows_outside) / steps;
  return to_resolution(surface.min().y() + part * height, options.resolution);
}

RasterPlan plan_finish_raster(const Eigen::AlignedBox2d& surface, double radius,
                              const RasterOptions& options) {
  RasterPlan plan{surface, radius, options};
  const Eigen::Vector2d size = surface.sizes();
  // A quotient that is whole but for rounding must not cost a row.
  const double steps = std::max(1.0, std::ceil(size.y() / options.pitch - 1e-9));
  plan.pitch = size.y() / steps;
  plan.rows_outside = static_cast<std::int64_t>(std::ceil(plan.reach() / plan.pitch));
  plan.rows = static_cast<std::int64_t>(steps) + 1 + 2 * plan.rows_outside;
  const double secant2 = 1.0 + kSteepestSlope * kSteepestSlope;
  const double spacing =
      std::sqrt(8.0 * radius * kSamplingShare * options.tolerance / (secant2 * std::sqrt(secant2)));
  const double length = size.x() + 2.0 * radius;
  plan.samples = static_cast<std::int64_t>(std::ceil(length / spacing)) + 1;
  plan.spacing = length / static_cast<double>(plan.samples - 1);
  return plan;
}

RasterRow cut_row(const DropCutter& cutter, const RasterPlan& plan, std::int64_t row) {
  const double y = plan.row_y(row);
  DropCurve curve(cutter, plan, y);
  const Profile even = sample_evenly(curve, plan);
  const Profile kept = simplify(refine(curve, plan, even), plan.options);
  RasterRow result;
  result.samples = curve.samples();
  result.points.reserve(kept.size());
  for (const Eigen::Vector2d& point : kept) result.points.emplace_back(point.x(), y, point.y());
  if (row % 2 == 1) std::reverse(result.points.begin(), result.points.end());
  return result;
}

RasterSummary cut_raster(const DropCutter& cutter, const RasterPlan& plan, const Executor& executor,
                         const std::function<void(const RasterRow&)>& sink,
                         const RunControl& control) {
  RasterSummary summary;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  std::vector<RasterRow> batch;
  for (std::int64_t begin = 0; begin < plan.rows; begin += kBatchRows) {
    const std::int64_t count = std::min(kBatchRows, plan.rows - begin);
    batch.assign(static_cast<std::size_t>(count), {});
    const auto cut = [&](std::int64_t i) {
      if (control.stop_requested()) return;
      batch[static_cast<std::size_t>(i)] = cut_row(cutter, plan, begin + i);
    };
    parallel_for(executor, "finish raster", count, cut, 1);
    if (control.stop_requested()) return summary;
    for (const RasterRow& row : batch) {
      add_row(row, last, summary);
      sink(row);
    }
    control.report({"cam finish", static_cast<double>(summary.rows), static_cast<double>(plan.rows),
                    std::to_string(summary.points) + " points"});
  }
  summary.complete = true;
  return summary;
}

}  // namespace lensforge
