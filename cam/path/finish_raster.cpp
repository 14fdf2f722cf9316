// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/finish_raster.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <string>
#include <thread>
#include <vector>

#include "cam/contact/ball_blend.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Rows cut at the same time: a few tenths of a second of work, so that a stop takes effect soon.
constexpr std::int64_t kBatchRows = 16;

/// Gaps in rows that are cut anyway, mm: at 500 mm/min they take no longer than going up, across
/// and down.
constexpr double kShortGap = 1.5;

/// Unit of the last decimal of exact paths, mm.
constexpr double kExactResolution = 1e-12;

RowFitOptions fit_options(const RasterOptions& options) {
  return {options.tolerance, options.slope_tolerance, {options.resolution, options.z_zero},
          options.arcs,      options.shortest,        {}};
}

void take_larger(const Extreme& one, Extreme& largest) {
  if (one.value > largest.value) largest = one;
}

/// Maps the plane of a row into space.
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

/// Options of a row's exact path: decimals are those of doubles, and arcs save memory.
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

/// Region of the tool's axis over some rows.
Eigen::AlignedBox2d axis_box(const RasterPlan& plan, std::int64_t begin, std::int64_t count) {
  Eigen::AlignedBox2d axis;
  for (const std::int64_t row : {begin, begin + count - 1}) {
    const RowSpan span = plan.row_span(row);
    axis.extend(span.line.at(plan.finished().min()[span.line.along] - plan.reach()));
    axis.extend(span.line.at(plan.finished().max()[span.line.along] + plan.reach()));
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

int decimals_for(double tolerance, double slope_tolerance) {
  const double finest = 0.25 * std::min(tolerance, slope_tolerance * kSlopeStretch);
  for (int decimals = 4; decimals < 6; ++decimals) {
    if (std::pow(10.0, -decimals) <= finest * (1.0 + 1e-9)) return decimals;
  }
  return 6;
}

Eigen::AlignedBox2d RasterPlan::finished() const {
  const Eigen::Vector2d apron = Eigen::Vector2d::Constant(options.apron);
  return {surface.min() - apron, surface.max() + apron};
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
  const Eigen::AlignedBox2d all = finished();
  const double low = all.min()[1 - along];
  const double high = all.max()[1 - along];
  const double place = row_place(row);
  const double rim = std::clamp(place, low, high);
  const double held = std::clamp(place, low - reach(), high + reach());
  const double remaining =
      std::sqrt(std::max(reach() * reach() - (held - rim) * (held - rim), 0.0));
  const double begin = all.min()[along];
  const double end = all.max()[along];
  return {{along, held},
          to_resolution(begin - radius, options.resolution),
          to_resolution(end + radius, options.resolution),
          begin - remaining,
          end + remaining};
}

/// Joins parts less than kShortGap apart: going up, across and down takes longer.
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
  // A quotient that is whole except for rounding must not cost a row.
  const double every = options.every;
  const double steps = every * std::max(1.0, std::ceil(width / (every * options.pitch) - 1e-9));
  plan.pitch = width / steps;
  const double beyond = options.apron + plan.reach();
  plan.rows_outside = static_cast<std::int64_t>(std::ceil(beyond / plan.pitch));
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

namespace {

/// Straight moves that descend by more than this, mm, and more steeply than surfaces finished to
/// their rim run at plunge feed: there a larger ball comes down from a lift.
constexpr double kLow = 0.05;

/// The same limit for links between rows that may end lifted, rise over run.
constexpr double kLiftedSlope = 0.3;

/// Height over the row's highest point on the way back, mm: above rounding and servo lag.
constexpr double kHop = 0.05;

double highest_of(const Eigen::Vector3d& start, const PathMove& move, int along) {
  const double ends = std::max(start.z(), move.end.z());
  if (move.arc_axis < 0 || move.centre.z() > ends) return ends;
  const double low = std::min(start[along], move.end[along]);
  const double high = std::max(start[along], move.end[along]);
  const bool over_the_top = low < move.centre[along] && move.centre[along] < high;
  return over_the_top ? move.centre.z() + (start - move.centre).norm() : ends;
}

double highest_of(const RasterRow& row, int along) {
  double highest = row.start.z();
  Eigen::Vector3d at = row.start;
  for (const PathMove& move : row.moves) {
    highest = std::max(highest, highest_of(at, move, along));
    at = move.end;
  }
  return highest;
}

/// Makes the moves between rows and sums everything up.
class FinishMoves {
 public:
  FinishMoves(const CutSurface& surface, const RasterPlan& plan, const FinishRun& run,
              const MoveSink& sink, OperationSummary& summary)
      : surface_(surface), plan_(plan), run_(run), sink_(sink), summary_(summary) {}

  void add(const RasterRow& row) {
    if (summary_.passes == 0) {
      move(MoveKind::kRapid, {row.start.x(), row.start.y(), run_.safe_z});
      move(MoveKind::kPlunge, row.start);
    } else if (plan_.rest != nullptr) {
      hop_to(row.start);
    } else if (plan_.options.style == PassStyle::kZigzag) {
      const double steepest = surface_.lift() != nullptr ? kLiftedSlope : kSteepestSlope;
      const bool down = dives({MoveKind::kCut, row.start}, steepest);
      move(down ? MoveKind::kPlunge : MoveKind::kCut, row.start);
    } else {
      go_back_to(row.start);
    }
    for (PathMove one : row.moves) {
      one.feed = dives(one, kSteepestSlope) ? run_.tool.plunge : run_.tool.feed;
      push(one);
    }
    highest_ = highest_of(row, plan_.options.along);
    ++summary_.passes;
    sink_(held_);
    held_.clear();
  }

  void end() {
    move(MoveKind::kRapid, {at_.x(), at_.y(), run_.safe_z});
    sink_(held_);
  }

 private:
  [[nodiscard]] double on_grid(double z) const {
    const double zero = plan_.options.z_zero;
    return zero + to_resolution(z - zero, plan_.options.resolution);
  }

  [[nodiscard]] bool dives(const PathMove& move, double steepest) const {
    const Eigen::Vector3d way = move.end - at_;
    return move.arc_axis < 0 && -way.z() > std::max(kLow, steepest * way.head<2>().norm());
  }

  void hop_to(const Eigen::Vector3d& start) {
    Eigen::AlignedBox2d axis(Eigen::Vector2d(at_.head<2>()));
    axis.extend(Eigen::Vector2d(start.head<2>()));
    const SmoothBed& bed = *surface_.bed();
    const double highest = bed.bounds().over(bed.footprint(axis)).highest;
    const double low = std::max(highest, std::max(at_.z(), start.z()));
    const double z = on_grid(low + std::max(run_.clearance, kHop));
    move(MoveKind::kRapid, {at_.x(), at_.y(), z});
    move(MoveKind::kRapid, {start.x(), start.y(), z});
    move(MoveKind::kRapid, {start.x(), start.y(), on_grid(start.z() + kHop)});
    move(MoveKind::kPlunge, start);
  }

  void go_back_to(const Eigen::Vector3d& start) {
    const int along = plan_.options.along;
    Eigen::Vector3d place = at_;
    place.z() = on_grid(std::max(highest_, start.z()) + kHop);
    move(MoveKind::kRapid, place);
    place[along] = start[along];
    move(MoveKind::kRapid, place);
    place[1 - along] = start[1 - along];
    move(MoveKind::kLink, place);
    move(MoveKind::kPlunge, start);
  }

  void move(MoveKind kind, const Eigen::Vector3d& end) {
    PathMove one;
    one.kind = kind;
    one.end = end;
    if (kind == MoveKind::kPlunge) one.feed = run_.tool.plunge;
    if (kind == MoveKind::kCut || kind == MoveKind::kLink) one.feed = run_.tool.feed;
    push(one);
  }

  void push(const PathMove& one) {
    const double length = summary_.moves > 0 ? row_move_length(at_, one) : 0.0;
    (one.kind == MoveKind::kRapid ? summary_.rapid_length : summary_.cutting_length) += length;
    if (one.kind != MoveKind::kRapid) summary_.tip.extend(one.end);
    summary_.arcs += one.arc_axis >= 0 ? 1 : 0;
    ++summary_.moves;
    held_.push_back(one);
    at_ = one.end;
  }

  const CutSurface& surface_;
  const RasterPlan& plan_;
  const FinishRun& run_;
  const MoveSink& sink_;
  OperationSummary& summary_;
  std::vector<PathMove> held_;
  Eigen::Vector3d at_ = Eigen::Vector3d::Zero();
  double highest_ = 0.0;
};

void warn(const RasterOptions& options, OperationSummary& summary) {
  const PathCertificate& certificate = summary.certificate;
  const auto place = [](const Extreme& extreme) {
    return " at x " + decimal_text(extreme.place.x(), 3) + " y " +
           decimal_text(extreme.place.y(), 3);
  };
  const auto warn_of_height = [&](const Extreme& extreme, const char* what) {
    if (extreme.value <= options.tolerance) return;
    summary.remarks.push_back("the path runs " + decimal_text(1e3 * extreme.value, 3) + " µm " +
                              what + " the exact one" + place(extreme) + ", more than the " +
                              decimal_text(1e3 * options.tolerance, 3) + " µm aimed at");
  };
  warn_of_height(certificate.gouge, "below");
  warn_of_height(certificate.excess, "above");
  if (certificate.slope.value <= options.slope_tolerance) return;
  summary.remarks.push_back("the path's direction is off by " +
                            decimal_text(1e3 * certificate.slope.value, 2) +
                            " mrad over a stretch of " + decimal_text(1e3 * kSlopeStretch, 0) +
                            " µm" + place(certificate.slope) + ", more than the " +
                            decimal_text(1e3 * options.slope_tolerance, 2) + " mrad aimed at");
}

}  // namespace

OperationSummary cut_finish(const CutSurface& surface, const RasterPlan& plan, const FinishRun& run,
                            const Executor& executor, const MoveSink& sink,
                            const RunControl& control) {
  OperationSummary summary;
  summary.name = run.name;
  summary.tool = run.tool.number;
  summary.stepover = plan.pitch;
  FinishMoves moves(surface, plan, run, sink, summary);
  const auto add = [&](const RasterRow& row) {
    moves.add(row);
    if (run.look) run.look(row);
  };
  const RasterSummary raster = cut_raster(surface, plan, executor, add, control);
  if (!raster.complete) return summary;
  moves.end();
  summary.complete = true;
  summary.certificate = raster.certificate;
  summary.certified = true;
  warn(plan.options, summary);
  return summary;
}

}  // namespace lensforge
