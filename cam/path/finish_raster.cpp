// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/finish_raster.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <string>
#include <thread>

#include "cam/contact/ball_blend.h"

namespace lensforge {
namespace {

/// Rows that are cut at the same time: a few tenths of a second of work, so that a stop is heard.
constexpr std::int64_t kBatchRows = 16;

/// Gaps in rows that are cut all the same, mm: at 500 mm/min they take no longer than a way up,
/// across and down.
constexpr double kShortGap = 1.5;

/// Unit of the last decimal of exact ways, mm.
constexpr double kExactResolution = 1e-12;

RowFitOptions fit_options(const RasterOptions& options) {
  return {options.tolerance, options.slope_tolerance, {options.resolution, options.z_zero},
          options.arcs,      options.shortest,        {}};
}

void take_larger(const Extreme& one, Extreme& largest) {
  if (one.value > largest.value) largest = one;
}

/// From the plane of a row into space.
class RowFrame {
 public:
  RowFrame(int along, double across) : line_{along, across} {}

  [[nodiscard]] Eigen::Vector3d point(double u, double z) const {
    const Eigen::Vector2d p = line_.at(u);
    return {p.x(), p.y(), z};
  }
  [[nodiscard]] Extreme placed(const Extreme& one) const {
    return {one.value, point(one.place.x(), one.place.y())};
  }
  [[nodiscard]] PathMove move(const RowMove& plane, const Eigen::Vector2d& end,
                              bool forward) const {
    PathMove move;
    move.end = point(end.x(), end.y());
    if (!plane.arc) return move;
    move.arc_axis = 1 - line_.along;
    move.centre = point(plane.centre.x(), plane.centre.y());
    // Seen from +x, y runs to the right and a cap followed to the right is clockwise; seen from +y,
    // x runs to the left.
    move.clockwise = (plane.cap == forward) == (line_.along == 1);
    return move;
  }

 private:
  AxisLine line_;
};

RasterWay in_space(const RowWay& way, const RowFrame& frame, bool forward) {
  RasterWay result;
  const Eigen::Vector2d& first = forward ? way.start : way.moves.back().end;
  result.start = frame.point(first.x(), first.y());
  result.moves.reserve(way.moves.size());
  if (forward) {
    for (const RowMove& move : way.moves) result.moves.push_back(frame.move(move, move.end, true));
    return result;
  }
  for (std::size_t i = way.moves.size(); i-- > 0;) {
    const Eigen::Vector2d& end = i > 0 ? way.moves[i - 1].end : way.start;
    result.moves.push_back(frame.move(way.moves[i], end, false));
  }
  return result;
}

/// For the exact way of a row: decimals are those of doubles, and arcs save memory.
RowFitOptions exact_fit(const RowFitOptions& fit) {
  return {kExactRow * fit.tolerance,
          kExactRow * fit.slope_tolerance,
          {kExactResolution, fit.grid.z_zero},
          true,
          0.0,
          fit.stop};
}

std::int64_t rows_at_once(const CutSurface& surface, const RasterPlan& plan) {
  const double rows = std::floor(surface.band() / plan.pitch) + 1.0;
  return static_cast<std::int64_t>(std::clamp(rows, 1.0, static_cast<double>(kBatchRows)));
}

/// Where the tool's axis goes on some rows.
Eigen::AlignedBox2d axis_box(const RasterPlan& plan, std::int64_t begin, std::int64_t count) {
  Eigen::AlignedBox2d axis;
  for (const std::int64_t row : {begin, begin + count - 1}) {
    const RowSpan span = plan.row_span(row);
    axis.extend(span.line.at(plan.surface.min()[span.line.along] - plan.reach()));
    axis.extend(span.line.at(plan.surface.max()[span.line.along] + plan.reach()));
  }
  return axis;
}

void add_row(const RasterRow& row, Eigen::Vector3d& last, RasterSummary& summary) {
  if (summary.points > 0) summary.length += (row.start - last).norm();
  summary.tip.extend(row.start);
  last = row.start;
  for (const PathMove& move : row.moves) {
    summary.length += row_move_length(last, move);
    summary.tip.extend(move.end);
    summary.arcs += move.arc_axis >= 0 ? 1 : 0;
    last = move.end;
  }
  summary.points += static_cast<std::int64_t>(row.moves.size()) + 1;
  summary.pieces += row.pieces;
  take_larger(row.certificate.gouge, summary.certificate.gouge);
  take_larger(row.certificate.excess, summary.certificate.excess);
  take_larger(row.certificate.slope, summary.certificate.slope);
}

void report(const RunControl& control, std::int64_t rows, std::int64_t of, std::int64_t points) {
  control.report({"cam finish", static_cast<double>(rows), static_cast<double>(of),
                  std::to_string(points) + " points"});
}

}  // namespace

double row_move_length(const Eigen::Vector3d& start, const PathMove& move) {
  const double chord = (move.end - start).norm();
  if (move.arc_axis < 0) return chord;
  const double radius = (start - move.centre).norm();
  return 2.0 * radius * std::asin(std::min(0.5 * chord / radius, 1.0));
}

double pitch_on_slope(double pitch, double steepest) {
  return pitch / std::sqrt(1.0 + steepest * steepest);
}

int decimals_for(double tolerance, double slope_tolerance) {
  const double finest = 0.25 * std::min(tolerance, slope_tolerance * kSlopeStretch);
  for (int decimals = 4; decimals < 6; ++decimals) {
    if (std::pow(10.0, -decimals) <= finest * (1.0 + 1e-9)) return decimals;
  }
  return 6;
}

double RasterPlan::reach() const {
  const double slope = options.rim_slope;
  return radius * slope / std::sqrt(1.0 + slope * slope);
}

double RasterPlan::row_place(std::int64_t row) const {
  const int across = 1 - options.along;
  const auto steps = static_cast<double>(rows - 1 - 2 * rows_outside);
  const double part = static_cast<double>(row - rows_outside) / steps;
  return to_resolution(surface.min()[across] + part * surface.sizes()[across], options.resolution);
}

RowSpan RasterPlan::row_span(std::int64_t row) const {
  const int along = options.along;
  const double low = surface.min()[1 - along];
  const double high = surface.max()[1 - along];
  const double place = row_place(row);
  const double rim = std::clamp(place, low, high);
  const double held = std::clamp(place, low - reach(), high + reach());
  const double remaining =
      std::sqrt(std::max(reach() * reach() - (held - rim) * (held - rim), 0.0));
  const double begin = surface.min()[along];
  const double end = surface.max()[along];
  return {{along, held},
          to_resolution(begin - radius, options.resolution),
          to_resolution(end + radius, options.resolution),
          begin - remaining,
          end + remaining};
}

/// Parts that are apart by less than kShortGap are one: the way up, across and down takes longer.
std::vector<RowSpan> RasterPlan::row_spans(std::int64_t row) const {
  const RowSpan whole = row_span(row);
  if (rest == nullptr) return {whole};
  constexpr double kWidth = BallBlend::kWidth + BallBlend::kRunOut;
  constexpr double kStep = 0.5 * RestMap::kCell;
  std::vector<RowSpan> spans;
  for (double u = whole.held_from; u < whole.held_to; u += kStep) {
    const double to = std::min(u + kStep, whole.held_to);
    if (std::min(rest->distance(whole.line.at(u)), rest->distance(whole.line.at(to))) > kWidth) {
      continue;
    }
    if (!spans.empty() && u - spans.back().held_to < kShortGap) {
      spans.back().held_to = to;
    } else {
      spans.push_back({whole.line, u, to, u, to});
    }
  }
  for (RowSpan& span : spans) {
    span.from = span.held_from > whole.held_from ? span.held_from - kLevelEnd : whole.from;
    span.to = span.held_to < whole.held_to ? span.held_to + kLevelEnd : whole.to;
    span.from = to_resolution(span.from, options.resolution);
    span.to = to_resolution(span.to, options.resolution);
  }
  if (!forward(row)) std::reverse(spans.begin(), spans.end());
  return spans;
}

/// Rows are cut in the order of ascending y (or x): uncut material is at +y, on the right of a tool
/// that moves towards −x, or at +x, on the right of one that moves towards +y.
bool RasterPlan::forward(std::int64_t row) const {
  switch (options.style) {
    case PassStyle::kClimb:
      return options.along == 1;
    case PassStyle::kConventional:
      return options.along == 0;
    case PassStyle::kZigzag:
      break;
  }
  return row % 2 == 0;
}

RasterPlan plan_finish_raster(const Eigen::AlignedBox2d& surface, double radius,
                              const RasterOptions& options) {
  RasterPlan plan{surface, radius, options};
  const double width = surface.sizes()[1 - options.along];
  // A quotient that is whole but for rounding must not cost a row.
  const double every = options.every;
  const double steps = every * std::max(1.0, std::ceil(width / (every * options.pitch) - 1e-9));
  plan.pitch = width / steps;
  plan.rows_outside = static_cast<std::int64_t>(std::ceil(plan.reach() / plan.pitch));
  plan.rows = static_cast<std::int64_t>(steps) + 1 + 2 * plan.rows_outside;
  return plan;
}

RasterRow cut_row(const RowCurves& curves, const RasterPlan& plan, std::int64_t row) {
  return cut_row(curves, plan, row, plan.row_span(row));
}

RasterRow cut_row(const RowCurves& curves, const RasterPlan& plan, std::int64_t row,
                  const RowSpan& span) {
  RowFitOptions fit = fit_options(plan.options);
  fit.stop = curves.stop();
  if (!curves.rolls()) fit.shortest = 0.0;  // Moves end in creases.
  RowProfile profile = curves.profile(span, joint_bow(fit));
  level_ends(fit.grid, profile);
  const FittedRow fitted = fit_row(profile, fit);
  const PathCertificate& certificate = fitted.certificate;
  const RowFrame frame(plan.options.along, plan.row_place(row));
  const bool forward = plan.forward(row);
  RasterRow result{in_space(fitted, frame, forward), {}, {}, {}, 0};
  if (plan.options.traces) {
    result.exact = in_space(fit_way(profile, exact_fit(fit)), frame, forward);
    result.unrounded = in_space(fitted.unrounded, frame, forward);
  }
  result.certificate = {frame.placed(certificate.gouge), frame.placed(certificate.excess),
                        frame.placed(certificate.slope)};
  result.pieces = static_cast<std::int64_t>(profile.u.size()) - 1;
  return result;
}

RasterSummary cut_raster(const CutSurface& surface, const RasterPlan& plan,
                         const Executor& executor,
                         const std::function<void(const RasterRow&)>& sink,
                         const RunControl& control) {
  RasterSummary summary;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  std::vector<std::vector<RasterRow>> batch;
  const std::int64_t most = rows_at_once(surface, plan);
  for (std::int64_t begin = 0; begin < plan.rows; begin += most) {
    const std::int64_t count = std::min(most, plan.rows - begin);
    if (control.stop_requested()) return summary;
    const RowCurves curves(surface, axis_box(plan, begin, count), executor);
    batch.assign(static_cast<std::size_t>(count), {});
    const std::thread::id caller = std::this_thread::get_id();
    std::atomic<std::int64_t> cut_rows{0};
    const auto cut = [&](std::int64_t i) {
      if (control.stop_requested()) return;
      for (const RowSpan& span : plan.row_spans(begin + i)) {
        batch[static_cast<std::size_t>(i)].push_back(cut_row(curves, plan, begin + i, span));
      }
      const std::int64_t done = summary.rows + ++cut_rows;
      // Fine rows take seconds; only the caller's thread may report.
      if (std::this_thread::get_id() == caller) report(control, done, plan.rows, summary.points);
    };
    parallel_for(executor, "finish raster", count, cut, 1);
    if (control.stop_requested()) return summary;
    for (const std::vector<RasterRow>& row : batch) {
      for (const RasterRow& part : row) {
        add_row(part, last, summary);
        sink(part);
      }
      ++summary.rows;
    }
    report(control, summary.rows, plan.rows, summary.points);
  }
  summary.complete = true;
  return summary;
}

}  // namespace lensforge
