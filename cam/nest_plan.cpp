// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/nest_plan.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "cam/cut_estimate.h"
#include "cam/nest_layout.h"
#include "cam/path/outline_cut.h"
#include "cam/path/rough.h"
#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Indices of refraction that one sheet may stand for, as the reports' check of the material.
constexpr double kSameIndex = 0.005;

std::string mm(double value) { return trimmed_decimal(value, 3) + " mm"; }

Eigen::AlignedBox3d box_of(const SurfaceMesh& mesh) {
  return {Eigen::Vector3d(mesh.vertices.rowwise().minCoeff()),
          Eigen::Vector3d(mesh.vertices.rowwise().maxCoeff())};
}

void require_options(const NestOptions& options) {
  const Eigen::Vector2d& blank = options.blank;
  if (!(blank.allFinite() && blank.minCoeff() > 0.0)) {
    throw InputError("--blank " + trimmed_decimal(blank.x(), 3) + "," +
                     trimmed_decimal(blank.y(), 3) + ": both sides must be above 0");
  }
  if (options.cam.part == PartKind::kMould) {
    throw InputError("--part mould: a mould has a blank of its own; cut it with cam");
  }
  if (options.cam.z_zero == ZZero::kLens) {
    throw InputError("--z-zero lens: lenses of one blank differ in height; must be stock or table");
  }
}

/// What lenses of one sheet have in common.
void require_alike(const std::vector<NestLens>& lenses) {
  if (lenses.empty()) throw InputError("DIR: no lens folder is named; must be one or more");
  const OpticalSetup& first = lenses.front().lens->setup;
  for (const NestLens& one : lenses) {
    const OpticalSetup& setup = one.lens->setup;
    if (setup.mode != first.mode) {
      const bool mirror = setup.mode == LightMode::kReflect;
      throw InputError(one.name + ": is a " + (mirror ? "mirror" : "lens") + ", " +
                       lenses.front().name + " is a " + (mirror ? "lens" : "mirror") +
                       ": one blank is for one kind; nest them apart");
    }
    if (setup.front) {
      throw InputError(one.name +
                       ": has a curved front, which its blank has before the first cut; cut it "
                       "alone with cam");
    }
    if (setup.mode == LightMode::kRefract && !(std::abs(setup.ior - first.ior) <= kSameIndex)) {
      throw InputError(one.name + ": was designed for index " + trimmed_decimal(setup.ior, 4) +
                       ", " + lenses.front().name + " for " + trimmed_decimal(first.ior, 4) +
                       ": one blank has one material, within 0.005");
    }
  }
}

double top_of(const NestLens& lens) { return box_of(lens.lens->surface).max().z(); }

const NestLens& highest_of(const std::vector<NestLens>& lenses) {
  return *std::max_element(lenses.begin(), lenses.end(), [](const NestLens& a, const NestLens& b) {
    return top_of(a) < top_of(b);
  });
}

/// Of the common blank: as given, or what the highest lens needs. @throw InputError
double thickness_of(const std::vector<NestLens>& lenses, const NestOptions& options) {
  const double needed = least_thickness(lenses, options);
  const double thickness = options.thickness.value_or(needed);
  if (thickness >= needed) return thickness;
  throw InputError("--blank: a thickness of " + mm(thickness) + " is too little for " +
                   highest_of(lenses).name + ": must be at least " +
                   trimmed_decimal(std::ceil(1e3 * needed) / 1e3, 3) + " mm, --stock " +
                   trimmed_decimal(options.cam.workshop.stock.allowance, 3) + " included");
}

/// What tools need around every lens, mm.
struct Room {
  double slot = 0.0;    ///< Width of the cut around lenses; 0 if none is cut out.
  double gap = 0.0;     ///< Between lenses.
  double edge = 0.0;    ///< Between lenses and the blank's edge.
  double margin = 0.0;  ///< Of each lens's own blank.
};

Room room_for(const std::vector<NestLens>& lenses, const NestOptions& options, double top) {
  const Workshop& workshop = options.cam.workshop;
  const Process& process = workshop.process;
  double reach = 0.0;
  Room room;
  for (const NestLens& one : lenses) {
    reach = std::max(reach, rough_reach(workshop, box_of(one.lens->surface), top));
    if (!cuts_outline(options.cam, one.lens->setup)) continue;
    const int number = options.cam.outline_tool > 0 ? options.cam.outline_tool : process.rough.tool;
    room.slot = workshop.tool(number).diameter;
  }
  const double frame = room.slot > 0.0 ? room.slot + kTabFrame : 0.0;
  const double widest = std::max(workshop.tool(process.rough.tool).diameter,
                                 workshop.tool(process.semi.tool).diameter);
  room.gap = std::max(reach + process.clearance, room.slot > 0.0 ? frame + room.slot : 0.0);
  room.edge = std::max(workshop.stock.margin, frame);
  // A roughing that is nearer to the edge than its tool's radius takes all that is left there.
  room.margin = std::max({room.edge, frame, reach + widest});
  return room;
}

double gap_of(const NestOptions& options, const Room& room) {
  if (options.gap == 0.0) return room.gap;
  if (options.gap >= room.gap) return options.gap;
  throw InputError("--gap " + trimmed_decimal(options.gap, 3) + ": must be at least " +
                   trimmed_decimal(std::ceil(1e3 * room.gap) / 1e3, 3) +
                   " mm for the tools, or 0 for that");
}

/// Of one lens: the shop with clamps where they lie from that lens, and its own blank.
CamOptions cut_of(const NestLens& one, const NestOptions& options, const NestedLens& placed,
                  const Room& room, double top) {
  CamOptions cut = options.cam;
  cut.job = one.name;
  cut.workshop.stock.margin = room.margin;
  cut.workshop.stock.allowance = top - box_of(one.lens->surface).max().z();
  for (KeepOut& clamp : cut.workshop.keep_outs) {
    clamp.low.head<2>() -= placed.box.min();
    clamp.high.head<2>() -= placed.box.min();
  }
  return cut;
}

}  // namespace

double least_thickness(const std::vector<NestLens>& lenses, const NestOptions& options) {
  return top_of(highest_of(lenses)) + options.cam.workshop.stock.allowance;
}

NestPlan plan_nest(const std::vector<NestLens>& lenses, const NestOptions& options) {
  require_options(options);
  require_alike(lenses);
  const double top = thickness_of(lenses, options);
  const Room room = room_for(lenses, options, top);
  NestPlan plan;
  plan.layout.blank = {options.blank.x(), options.blank.y(), top};
  plan.layout.gap = gap_of(options, room);
  plan.layout.edge = room.edge;
  plan.layout.slot = room.slot;
  plan.layout.keep_outs = options.cam.workshop.keep_outs;
  std::vector<NestItem> items;
  for (const NestLens& one : lenses) items.push_back({one.name, one.lens->setup.lens_size});
  const std::vector<Eigen::Vector2d> corners =
      place_in_rows(items, {options.blank, plan.layout.gap, room.edge});
  for (std::size_t k = 0; k < lenses.size(); ++k) {
    NestedLens placed;
    placed.name = lenses[k].name;
    placed.box = {corners[k], Eigen::Vector2d(corners[k] + items[k].size)};
    placed.outline = edge_of(lenses[k].lens->setup);
    for (Eigen::Vector2d& p : placed.outline) p += corners[k];
    placed.cut_out = cuts_outline(options.cam, lenses[k].lens->setup);
    plan.cuts.push_back(cut_of(lenses[k], options, placed, room, top));
    validate(plan.cuts.back(), lenses[k].lens->setup);
    plan.layout.lenses.push_back(std::move(placed));
  }
  return plan;
}

WorkEstimate estimate_nest(const NestPlan& plan, const std::vector<NestLens>& lenses, int threads) {
  WorkEstimate sum;
  for (std::size_t k = 0; k < lenses.size(); ++k) {
    const WorkEstimate one = estimate_cut(plan.cuts[k], lenses[k].lens->setup, threads);
    sum.seconds += one.seconds;
    sum.disk_bytes += one.disk_bytes;
    sum.memory_bytes += one.memory_bytes;
  }
  return sum;
}

}  // namespace lensforge
