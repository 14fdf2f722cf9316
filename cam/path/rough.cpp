// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/rough.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "cam/path/rough_passes.h"
#include "cam/path/tip_floor.h"
#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Cells of the stock map: a quarter of the smallest default ball's diameter. On slopes of 0.3 the
/// map overstates the material by 0.03 mm.
constexpr double kStockCell = 0.1;
constexpr double kMaxCells = 2000.0;  ///< Along the blank's longer side.

/// One raster, on one level or many.
struct Raster {
  std::string name;
  const Tool& tool;
  double stepover;
  double allowance;
  double ramp_angle_deg;
  double helix_radius;  ///< mm; 0 for ramps.
  double spacing;
  PassStyle style;
  PassAxis along;
};

template <class Following>
Raster raster_of(const char* name, const Workshop& workshop, const Following& process) {
  return {name,
          workshop.tool(process.tool),
          process.stepover,
          process.allowance,
          process.ramp_angle_deg,
          process.entry == EntryStyle::kHelix ? process.helix_radius : 0.0,
          process.spacing,
          process.style,
          process.along};
}

Eigen::AlignedBox2d from_above(const Eigen::AlignedBox3d& box) {
  return {box.min().head<2>(), box.max().head<2>()};
}

Eigen::AlignedBox2d grown_by(const Eigen::AlignedBox2d& box, double beyond) {
  const Eigen::Vector2d all(beyond, beyond);
  return {box.min() - all, box.max() + all};
}

/// Distance beyond the lens of later tools' axes: the finishing ball turns a full radius outside
/// and needs clear material there, so the semi-finishing tool goes twice as far.
double axis_beyond(const Workshop& workshop) {
  return 2.0 * workshop.tool(workshop.process.finish.tool).radius();
}

/// Width beside the lens that must be cleared to the rim's height before later tools come, mm.
double cleared_width(const Workshop& workshop, const Eigen::AlignedBox3d& surface, double top) {
  const Tool& ball = workshop.tool(workshop.process.finish.tool);
  const double depth = top - surface.min().z() + ball.radius();
  double width = axis_beyond(workshop) + widest_below(ball, depth);
  if (workshop.process.semi.enabled) {
    const Tool& semi = workshop.tool(workshop.process.semi.tool);
    width = std::max(width, axis_beyond(workshop) + widest_below(semi, depth));
  }
  return width + workshop.process.clearance;
}

/// Rectangle of the axis: `beyond` around the lens, or out of the blank on sides where less than
/// the tool's radius would be left standing.
Eigen::AlignedBox2d axis_area(const RoughSite& site, double radius, double beyond) {
  const Eigen::AlignedBox2d lens = from_above(site.surface.bounds());
  const Eigen::AlignedBox2d blank = from_above(site.stock.blank());
  const auto side = [&](double margin) {
    return beyond + radius >= margin - radius ? margin + radius : beyond;
  };
  Eigen::AlignedBox2d area = lens;
  for (int axis = 0; axis < 2; ++axis) {
    area.min()[axis] -= side(lens.min()[axis] - blank.min()[axis]);
    area.max()[axis] += side(blank.max()[axis] - lens.max()[axis]);
  }
  return area;
}

/// Heights of equal steps from `top`, excluded, to `lowest`, included.
std::vector<double> level_heights(double top, double lowest, double stepdown) {
  const double count = std::max(1.0, std::ceil((top - lowest) / stepdown - 1e-9));
  std::vector<double> levels;
  for (double level = 1.0; level <= count; ++level) {
    levels.push_back(top - (top - lowest) * level / count);
  }
  return levels;
}

/// With a clockwise spindle a tool climbs where the uncut side, here that of the later passes, is
/// on the right of its travel: towards −x with passes along x, towards +y along y.
bool starts_backwards(const Raster& raster) {
  const bool climb_is_back = raster.along == PassAxis::kX;
  if (raster.style == PassStyle::kClimb) return climb_is_back;
  return raster.style == PassStyle::kConventional && !climb_is_back;
}

/// One run over all levels and passes.
class RasterRun {
 public:
  RasterRun(const RoughSite& site, const Raster& raster, const PassGrid& grid,
            const TipFloor& floor, RoughMoves& moves)
      : raster_(raster),
        grid_(grid),
        moves_(moves),
        links_({site.workshop, raster.tool, floor, site.stock,
                safe_height_of(site.workshop, site.stock.blank()), raster.ramp_angle_deg,
                raster.helix_radius, raster.spacing},
               moves),
        backwards_(starts_backwards(raster)) {}

  /// @return the number of parts of passes cut.
  std::int64_t level(double height, double previous, const RunControl& control) {
    std::int64_t cut = 0;
    for (std::int64_t pass = 0; pass < grid_.passes(); ++pass) {
      if (control.stop_requested()) throw Interrupted();
      std::vector<PassPart> parts = grid_.parts(pass, height, previous);
      if (parts.empty()) continue;
      if (backwards_) turn(parts);
      for (const PassPart& part : parts) follow(part, height);
      cut += static_cast<std::int64_t>(parts.size());
      if (raster_.style == PassStyle::kZigzag) backwards_ = !backwards_;
      control.report({"cam " + raster_.name, static_cast<double>(pass + 1),
                      static_cast<double>(grid_.passes()), "down to z " + decimal_text(height, 2)});
    }
    links_.retract();
    cutting_ = false;
    return cut;
  }

 private:
  static void turn(std::vector<PassPart>& parts) {
    std::reverse(parts.begin(), parts.end());
    for (PassPart& part : parts) std::reverse(part.path.begin(), part.path.end());
  }

  void follow(const PassPart& part, double height) {
    const TipPath& path = part.path;
    const double near = 1.5 * grid_.stepover() + 2.0 * raster_.spacing;
    const bool beside = moves_.placed() && raster_.style == PassStyle::kZigzag &&
                        (path.front() - moves_.at()).head<2>().norm() <= near;
    if (!beside || !cutting_ || !links_.cross(path.front(), height)) links_.enter(path);
    for (std::size_t i = 1; i < path.size(); ++i) moves_.feed(MoveKind::kCut, path[i]);
    // A tool lifted by a clamp must not come down at the cutting feed.
    cutting_ = !part.lifted;
  }

  const Raster& raster_;
  const PassGrid& grid_;
  RoughMoves& moves_;
  RoughLinks links_;
  bool backwards_;
  bool cutting_ = false;  ///< The tool is at the end of a pass that no clamp has lifted.
};

void warn_of_clamps(const RoughSite& site, const Raster& raster, OperationSummary& summary) {
  const Eigen::AlignedBox2d lens = from_above(site.surface.bounds());
  for (const KeepOut& box : site.workshop.keep_outs) {
    const double away = raster.tool.radius() + site.workshop.process.clearance;
    const Eigen::AlignedBox2d taken =
        grown_by({box.low.head<2>(), box.high.head<2>()}, away).intersection(lens);
    if (taken.isEmpty()) continue;
    summary.warnings.push_back(
        "the keep-out box '" + box.name + "' keeps tool " + std::to_string(raster.tool.number) +
        " from the lens at x " + decimal_text(taken.min().x(), 1) + " to " +
        decimal_text(taken.max().x(), 1) + " y " + decimal_text(taken.min().y(), 1) + " to " +
        decimal_text(taken.max().y(), 1) + ": that part stays uncut");
  }
}

void warn_of_flutes(const Tool& tool, const Extreme& deepest, OperationSummary& summary) {
  if (deepest.value <= tool.flute_length) return;
  summary.warnings.push_back(
      "tool " + std::to_string(tool.number) + " cuts " + decimal_text(deepest.value, 2) +
      " mm deep at x " + decimal_text(deepest.place.x(), 1) + " y " +
      decimal_text(deepest.place.y(), 1) + ", its flutes are " +
      decimal_text(tool.flute_length, 2) + " mm long: use smaller steps down or a longer tool");
}

/// Further inputs of a run.
struct RunPlan {
  double beyond;    ///< Of the axis, around the lens, mm.
  double stepdown;  ///< 0: one level that follows the surface.
};

RoughResult cut(const RoughSite& site, const Raster& raster, const RunPlan& plan,
                const Executor& executor, const MoveSink& sink, const RunControl& control) {
  const Workshop& workshop = site.workshop;
  const TipFloor floor(site.surface, raster.tool, raster.allowance, workshop.keep_outs,
                       workshop.process.clearance);
  const double radius = raster.tool.radius();
  const PassGrid grid(floor,
                      {axis_area(site, radius, std::max(plan.beyond, floor.hold())),
                       grown_by(from_above(site.stock.blank()), radius), raster.along,
                       raster.stepover, raster.spacing},
                      executor, control);
  RoughResult result;
  OperationSummary& summary = result.summary;
  summary.name = raster.name;
  summary.tool = raster.tool.number;
  summary.stepover = grid.stepover();
  summary.allowance = raster.allowance;
  RoughMoves moves(raster.tool, site.stock, sink, summary);
  RasterRun run(site, raster, grid, floor, moves);
  double previous = site.stock.blank().max().z();
  const double lowest = std::min(grid.lowest(), previous);
  const std::vector<double> levels =
      level_heights(previous, lowest, plan.stepdown > 0.0 ? plan.stepdown : HUGE_VAL);
  if (plan.stepdown > 0.0)
    summary.stepdown = (previous - lowest) / static_cast<double>(levels.size());
  for (const double level : levels) {
    summary.passes += run.level(level, previous, control);
    previous = level;
  }
  moves.flush();
  summary.certificate.excess = grid.excess();
  summary.certified = true;
  summary.complete = true;
  result.deepest_cut = moves.deepest_cut();
  result.most_left = most_left(site.stock, site.surface, executor);
  warn_of_clamps(site, raster, summary);
  warn_of_flutes(raster.tool, result.deepest_cut, summary);
  return result;
}

}  // namespace

StockMap whole_blank(const Workshop& workshop, const Eigen::AlignedBox3d& surface) {
  const Eigen::AlignedBox3d blank = workshop.stock.box(surface);
  const double longest = blank.sizes().head<2>().maxCoeff();
  return {blank, std::max(kStockCell, longest / kMaxCells)};
}

double rough_reach(const Workshop& workshop, const Eigen::AlignedBox3d& surface, double top) {
  const auto reach = [&](const auto& process, double beyond) {
    if (!process.enabled) return 0.0;
    const Tool& tool = workshop.tool(process.tool);
    return std::max(beyond, TipFloor::hold_of(tool, process.allowance)) + tool.radius();
  };
  const Process& process = workshop.process;
  const double rough_radius = workshop.tool(process.rough.tool).radius();
  return std::max(reach(process.rough, cleared_width(workshop, surface, top) - rough_radius),
                  reach(process.semi, axis_beyond(workshop)));
}

RoughResult cut_rough(const RoughSite& site, const Executor& executor, const MoveSink& sink,
                      const RunControl& control) {
  const RoughProcess& process = site.workshop.process.rough;
  const Raster raster = raster_of("rough", site.workshop, process);
  const double width =
      cleared_width(site.workshop, site.surface.bounds(), site.stock.blank().max().z());
  const RunPlan plan{width - raster.tool.radius(), process.stepdown};
  return cut(site, raster, plan, executor, sink, control);
}

RoughResult cut_semi(const RoughSite& site, const Executor& executor, const MoveSink& sink,
                     const RunControl& control) {
  const Raster raster = raster_of("semi", site.workshop, site.workshop.process.semi);
  return cut(site, raster, {axis_beyond(site.workshop), 0.0}, executor, sink, control);
}

}  // namespace lensforge
