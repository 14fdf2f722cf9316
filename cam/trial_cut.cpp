// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/trial_cut.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "cam/finish_paths.h"
#include "cam/finish_setup.h"
#include "cam/leakage/render_field.h"
#include "cam/milled/creases.h"
#include "cam/milled/milled_field.h"
#include "cam/milled/mould.h"
#include "cam/milled/polished_field.h"
#include "cam/part_layers.h"
#include "core/error.h"

namespace lensforge {
namespace {

/// A part of a grid, on that grid or a finer one.
struct CellGrid {
  GridWindow grid;
  CellRange cells;
};

/// Every cell cut into parts, the same number of all, so that none is wider than `spacings`.
CellGrid refined(const GridWindow& grid, const CellRange& cells, const Eigen::Vector2d& spacings) {
  const auto parts = [&](int axis) {
    const double ratio = grid.spacing[axis] / spacings[axis];
    return std::max<std::int64_t>(1, std::llround(std::ceil(ratio * (1.0 - 1e-9))));
  };
  const std::int64_t across = parts(0);
  const std::int64_t up = parts(1);
  CellGrid fine{grid, cells};
  fine.grid.spacing.x() /= static_cast<double>(across);
  fine.grid.spacing.y() /= static_cast<double>(up);
  fine.grid.columns = (grid.columns - 1) * across + 1;
  fine.grid.rows = (grid.rows - 1) * up + 1;
  fine.cells = {cells.column * across, cells.row * up, cells.columns * across, cells.rows * up};
  return fine;
}

Eigen::AlignedBox2d box_of(const GridWindow& grid, const CellRange& cells) {
  return {grid.node(cells.column, cells.row),
          grid.node(cells.column + cells.columns, cells.row + cells.rows)};
}

/// Where a rectangle of the lens is cut: mirrored along x and larger in a mould (CastFrame).
Eigen::AlignedBox2d in_mould(const Eigen::AlignedBox2d& lens,
                             const std::optional<CastFrame>& mould) {
  if (!mould) return lens;
  const double s = mould->scale;
  return {Eigen::Vector2d(s * (mould->width - lens.max().x()), s * lens.min().y()),
          Eigen::Vector2d(s * (mould->width - lens.min().x()), s * lens.max().y())};
}

/// What a program has to say for a rectangle to be cut.
Eigen::AlignedBox2d as_written(Eigen::AlignedBox2d box, const AxisStretch& stretch) {
  box.min()[stretch.axis] /= stretch.factor;
  box.max()[stretch.axis] /= stretch.factor;
  return box;
}

Eigen::AlignedBox2d grown_within(const Eigen::AlignedBox2d& box, double beyond,
                                 const Eigen::AlignedBox2d& limits) {
  const Eigen::Vector2d all = Eigen::Vector2d::Constant(beyond);
  return Eigen::AlignedBox2d(box.min() - all, box.max() + all).intersection(limits);
}

/// The rows of a raster that cross a box, no longer than the box: on the same places.
RasterPlan raster_around(const RasterPlan& whole, const Eigen::AlignedBox2d& box) {
  const int across = 1 - whole.options.along;
  const double begin = whole.surface.min()[across];
  Eigen::AlignedBox2d part = box;
  const double first = std::floor((box.min()[across] - begin) / whole.pitch);
  const double last = std::ceil((box.max()[across] - begin) / whole.pitch);
  part.min()[across] = begin + std::max(0.0, first) * whole.pitch;
  part.max()[across] = std::min(begin + last * whole.pitch, whole.surface.max()[across]);
  RasterOptions options = whole.options;
  options.pitch = whole.pitch;
  options.every = 1;
  RasterPlan plan = plan_finish_raster(part, whole.radius, options);
  plan.rest = whole.rest;
  return plan;
}

/// The runs of a valley's places that lie in a box.
std::vector<Valley> parts_in(const Valley& valley, const Eigen::AlignedBox2d& box) {
  std::vector<Valley> parts(1);
  for (const Eigen::Vector2d& place : valley) {
    if (box.contains(place)) {
      parts.back().push_back(place);
    } else if (!parts.back().empty()) {
      parts.emplace_back();
    }
  }
  std::erase_if(parts, [](const Valley& part) { return part.size() < 2; });
  return parts;
}

/// What the light of a place changes in a picture when `now` takes the place of `before`.
struct Exchange {
  double leakage = 0.0;
  double dark_flux = 0.0;
};

Exchange exchange(const LeakageResult& predicted, const FluxPicture& before,
                  const FluxPicture& now) {
  const std::vector<double>& part = predicted.part().picture.flux;
  const std::vector<double>& designed = predicted.designed.picture.flux;
  Exchange sum;
  for (std::size_t i = 0; i < part.size(); ++i) {
    const double more = now.flux[i] - before.flux[i];
    sum.leakage +=
        std::max(0.0, part[i] + more - designed[i]) - std::max(0.0, part[i] - designed[i]);
    sum.dark_flux += predicted.dark[i] * more;
  }
  return sum;
}

}  // namespace

TrialCut::TrialCut(const TrialSite& site, const CamOptions& changed, const Executor& executor)
    : site_(site), options_(changed), executor_(executor), balls_(&site.plan.balls()) {
  if (!same_balls(changed, site.plan.options())) {
    own_ = std::make_unique<const FinishBalls>(site.plan.optical(), changed, executor);
    balls_ = own_.get();
  }
  passes_ = balls_->passes(changed, site.plan.ground());
  for (FinishPass& pass : passes_) pass.plan.options.traces = false;
}

TrialCut::Work TrialCut::work(const RunControl& control) const {
  Work work;
  for (const FinishPass& pass : passes_) {
    const RasterPlan& plan = pass.plan;
    std::vector<Work> rows(kWorkRows);
    parallel_for(executor_, "remedies' work", kWorkRows, [&](std::int64_t i) {
      if (control.stop_requested()) return;
      const std::int64_t number = plan.rows * (2 * i + 1) / (2 * kWorkRows);
      Work& one = rows[static_cast<std::size_t>(i)];
      for (const RowSpan& span : plan.row_spans(number)) {
        Eigen::AlignedBox2d axis(span.line.at(span.from));
        axis.extend(span.line.at(span.to));
        const RowCurves curves(*pass.surface, axis, Executor::serial());
        one.moves += static_cast<double>(cut_row(curves, plan, number, span).moves.size());
        one.minutes += (span.to - span.from + plan.pitch) / pass.tool.feed;
      }
    });
    if (control.stop_requested()) throw Interrupted();
    for (const Work& one : rows) {
      work.moves += one.moves * static_cast<double>(plan.rows) / kWorkRows;
      work.minutes += one.minutes * static_cast<double>(plan.rows) / kWorkRows;
    }
  }
  return work;
}

std::vector<BallPath> TrialCut::paths_around(const Eigen::AlignedBox2d& box,
                                             const RunControl& control) const {
  const AxisStretch stretch = AxisStretch::of(options_.workshop.process.finish);
  std::vector<BallPath> paths;
  for (const FinishPass& pass : passes_) {
    BallPath& path = paths.emplace_back(pass.tool.radius(), 0.0);
    const MoveSink sink = path_sink(path, stretch);
    const auto add = [&](const RasterRow& row) {
      const PathMove start{MoveKind::kRapid, row.start};
      sink({&start, 1});
      sink(row.moves);
    };
    const RasterPlan plan = raster_around(pass.plan, box);
    if (!cut_raster(*pass.surface, plan, executor_, add, control).complete) throw Interrupted();
  }
  if (options_.workshop.process.finish.pencil) {
    BallPath& path = paths.emplace_back(finishing_ball(options_).radius(), 0.0);
    add_pencil(box, path_sink(path, stretch), control);
  }
  return paths;
}

void TrialCut::add_pencil(const Eigen::AlignedBox2d& box, const MoveSink& sink,
                          const RunControl& control) const {
  const PencilOptions pencil =
      pencil_options(options_, site_.plan.z_offset(), site_.plan.part_box().max().z());
  std::vector<Valley> inside;
  for (const Valley& valley :
       find_valleys(site_.plan.mesh(), finishing_ball(options_).radius(), pencil)) {
    for (Valley& part : parts_in(valley, box)) inside.push_back(std::move(part));
  }
  if (inside.empty()) return;
  const FinishRun run{"pencil", finishing_ball(options_), site_.plan.blank().max().z(), {}, {}};
  if (!cut_pencil(balls_->surface(), inside, pencil, run, sink, control).complete) {
    throw Interrupted();
  }
}

/// Rows reach as far as the polishing does and a diameter beyond, because the last radius of a row
/// is level and what it cuts reaches a radius farther.
LeakTrial TrialCut::at(const LeakPlace& place, const RunControl& control) const {
  const RunControl silent(control.stop_token(), {});
  const CamOptions& before = site_.plan.options();
  const GridWindow grid =
      sampled_grid(site_.lens.setup.lens_size, sample_spacings(before, site_.lens.setup));
  const CellGrid fine = refined(grid, place.cells, sample_spacings(options_, site_.lens.setup));
  const std::optional<CastFrame> mould = site_.plan.mould();
  const double polished = PolishedField::kReach * options_.workshop.polish.sigma +
                          (1.0 + kCreaseHalo) * grid.spacing.maxCoeff();
  const double beyond = (mould ? mould->scale : 1.0) * polished + passes_.front().tool.diameter;
  const AxisStretch stretch = AxisStretch::of(options_.workshop.process.finish);
  const Eigen::AlignedBox2d box =
      grown_within(as_written(in_mould(box_of(grid, place.cells), mould), stretch), beyond,
                   site_.plan.rectangle());
  const MilledField milled(paths_around(box, silent), site_.plan.blank().max().z());
  std::optional<CastField> cast;
  if (mould) cast.emplace(milled, *mould);
  const SurfaceField& raw = cast ? static_cast<const SurfaceField&>(*cast) : milled;
  const Eigen::Vector2d size = site_.lens.setup.lens_size;
  const PolishedField part(raw, site_.designed, {Eigen::Vector2d(0.0, 0.0), size},
                           options_.workshop.polish);
  FieldRenderSetup setup{.optics = site_.lens.setup,
                         .grid = grid,
                         .surface_height = site_.lens.surface.vertices.row(2).mean()};
  const FluxPicture predicted = render_cells(site_.part, setup, place.cells, executor_, silent);
  setup.grid = fine.grid;
  const FluxPicture now = render_cells(part, setup, fine.cells, executor_, silent);
  const Exchange change = exchange(site_.leakage, predicted, now);
  LeakTrial trial;
  trial.leakage = place.leakage + change.leakage;
  trial.dark_flux = place.dark_flux + change.dark_flux;
  return trial;
}

}  // namespace lensforge
