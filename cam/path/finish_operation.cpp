// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/finish_operation.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Straight moves that go down by more than this, mm, and more steeply than surfaces that are
/// finished to their rim are made at plunge feed: where a larger ball comes down from a lift.
constexpr double kLow = 0.05;

/// The same of ways from row to row where rows may end lifted, rise over run.
constexpr double kLiftedSlope = 0.3;

/// Height over the row's highest point on the way back, mm: above rounding and what a servo lags.
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

/// Makes the moves between rows and adds everything up.
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
    summary.warnings.push_back("the path runs " + decimal_text(1e3 * extreme.value, 3) + " µm " +
                               what + " the exact one" + place(extreme) + ", more than the " +
                               decimal_text(1e3 * options.tolerance, 3) + " µm aimed at");
  };
  warn_of_height(certificate.gouge, "below");
  warn_of_height(certificate.excess, "above");
  if (certificate.slope.value <= options.slope_tolerance) return;
  summary.warnings.push_back("the path's direction is off by " +
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
