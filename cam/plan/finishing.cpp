// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/plan/finishing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <tuple>
#include <utility>

#include "cam/milled/polished_field.h"
#include "cam/post/program_reader.h"
#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Factor by which moves should exceed the controller's shortest: some are cut in two.
constexpr double kAboveShortest = 2.0;

/// Minimum target of the path's slope error per millimetre of the last decimal: finer targets than
/// the decimals allow lead only to moves of a few micrometres, which turn more.
constexpr double kGridSlope = 10.0;

/// Width of the apron in σ beyond the polish's kernel: up to 3 more nodes, which are up to σ apart,
/// are sampled.
constexpr double kApronSigmas = 3.0;

RasterPlan finish_raster(const CamOptions& options, const FinishGround& ground, PassAxis along) {
  const FinishProcess& finish = options.workshop.process.finish;
  const double radius = finishing_ball(options).radius();
  RasterOptions raster;
  raster.pitch = max_pitch(finish, radius, ground.steepest);
  raster.tolerance = finish.tolerance;
  raster.slope_tolerance = aimed_slope(options);
  raster.resolution = resolution_of(options);
  raster.z_zero = -ground.z_offset;
  raster.along = along == PassAxis::kX ? 0 : 1;
  raster.style = finish.style;
  raster.arcs = options.arcs && options.post.arcs != ArcForm::kNone;
  raster.shortest = shortest_move(options, finishing_ball(options));
  raster.traces = options.render;
  raster.apron = ground.apron;
  if (larger_ball(options) != nullptr) raster.every = finish.large_every;
  return plan_finish_raster(ground.rectangle, radius, raster);
}

}  // namespace

const Tool& finishing_ball(const CamOptions& options) {
  return options.workshop.tool(options.workshop.process.finish.tool);
}

const Tool* larger_ball(const CamOptions& options) {
  const int number = options.workshop.process.finish.large_tool;
  return number == 0 ? nullptr : &options.workshop.tool(number);
}

double apron_to_cut(const CamOptions& options) {
  const double scale = options.part == PartKind::kMould ? 1.0 / (1.0 - options.shrinkage) : 1.0;
  const PolishModel& polish = options.workshop.polish;
  return finishing_ball(options).radius() +
         (kApronSigmas + polish_reach(polish)) * polish.sigma * scale;
}

int decimals_of(const CamOptions& options) {
  if (options.decimals > 0) return options.decimals;
  const FinishProcess& finish = options.workshop.process.finish;
  return std::min(options.post.most_decimals,
                  decimals_for(finish.tolerance, finish.slope_tolerance));
}

double resolution_of(const CamOptions& options) { return std::pow(10.0, -decimals_of(options)); }

double aimed_slope(const CamOptions& options) {
  return std::max(options.workshop.process.finish.slope_tolerance,
                  kGridSlope * resolution_of(options));
}

std::string decimals_warning(const CamOptions& options) {
  const double stated = options.workshop.process.finish.slope_tolerance;
  const double aimed = aimed_slope(options);
  if (aimed <= stated) return {};
  const double rounding = resolution_of(options) / kSlopeStretch;
  return "with " + std::to_string(decimals_of(options)) +
         " decimals rounding turns the path by up to " + number_text(1e3 * rounding) +
         " mrad over 5 µm, so that its direction is aimed at " + number_text(1e3 * aimed) +
         " mrad instead of " + number_text(1e3 * stated) +
         " (--slope-tolerance); take a post with 6 decimals where its limit has to hold";
}

double shortest_move(const CamOptions& options, const Tool& tool) {
  const double lines = options.workshop.machine.lines_per_second;
  return lines > 0.0 ? kAboveShortest * tool.feed / (60.0 * lines) : 0.0;
}

FinishGround unknown_ground(const CamOptions& options, const OpticalSetup& setup) {
  return {{Eigen::Vector2d(0.0, 0.0), size_to_cut(options, setup)},
          kUnknownSlope,
          0.0,
          apron_to_cut(options)};
}

std::vector<RasterPlan> finish_rasters(const CamOptions& options, const FinishGround& ground) {
  const FinishProcess& finish = options.workshop.process.finish;
  std::vector<RasterPlan> plans{finish_raster(options, ground, finish.along)};
  const PassAxis across = finish.along == PassAxis::kX ? PassAxis::kY : PassAxis::kX;
  if (finish.cross) plans.push_back(finish_raster(options, ground, across));
  return plans;
}

double finish_pitch(const CamOptions& options, const FinishGround& ground) {
  return finish_rasters(options, ground).front().pitch;
}

Passes passes_on_lens(const CamOptions& options, const FinishGround& ground) {
  const FinishProcess& finish = options.workshop.process.finish;
  Passes passes;
  passes.cast = options.part == PartKind::kMould;
  const double scale = passes.cast ? 1.0 / (1.0 - options.shrinkage) : 1.0;
  passes.pitch = finish_pitch(options, ground) / scale;
  passes.ball_radius = finishing_ball(options).radius() / scale;
  passes.axis = finish.along == PassAxis::kX ? 0 : 1;
  passes.zigzag = finish.style == PassStyle::kZigzag;
  passes.cross = finish.cross;
  return passes;
}

PencilOptions pencil_options(const CamOptions& options, double z_offset, double top) {
  PencilOptions pencil;
  pencil.resolution = resolution_of(options);
  pencil.z_zero = -z_offset;
  pencil.top = top;
  pencil.clearance = options.workshop.process.clearance;
  return pencil;
}

namespace {

/// Facets of a surface without creases, which are followed only in grooves about as tight as the
/// ball (RowCurves), and by the pencil.
constexpr SmoothCutOptions kSmoothCut{1e-4, 2e-2};

/// Slope up to which the larger ball finishes a surface to its rim, rise over run; it leaves
/// steeper places there.
constexpr double kRimSlope = 0.4;

std::unique_ptr<CutSurface> larger_surface(const std::shared_ptr<const OpticalSurface>& surface,
                                           const Tool& ball, const Executor& executor) {
  if (surface->has_creases()) {
    throw InputError("finish.large_tool " + std::to_string(ball.number) +
                     ": needs a surface without creases; use --surface smooth");
  }
  return surface_to_cut(surface, ball.radius(), executor);
}

BallBlend::Rows rows_of(const CamOptions& options, const FinishGround& ground, const Tool& large) {
  return {finishing_ball(options).radius(), large.radius(), finish_pitch(options, ground),
          options.workshop.process.finish.large_every};
}

}  // namespace

std::unique_ptr<CutSurface> surface_to_cut(std::shared_ptr<const OpticalSurface> surface,
                                           double radius, const Executor& executor) {
  if (surface->has_creases()) {
    return std::make_unique<FacetCutSurface>(surface->mesh(), radius, executor);
  }
  return std::make_unique<SmoothCutSurface>(std::move(surface), radius, kSmoothCut, executor);
}

FinishBalls::Shared::Shared(std::unique_ptr<CutSurface> larger, const CutSurface& smaller,
                            const BallBlend::Rows& rows, const Executor& executor)
    : large(std::move(larger)),
      rest(*large->bed(), BallBlend::kWidth + 2.0 * BallBlend::kRunOut, executor),
      blend(rows),
      small_lift(rest, blend, SharedLift::Ball::kSmall),
      large_lift(rest, blend, SharedLift::Ball::kLarge),
      lifted_small(smaller, small_lift),
      lifted_large(*large, large_lift) {}

FinishBalls::FinishBalls(const std::shared_ptr<const OpticalSurface>& surface,
                         const CamOptions& options, const FinishGround& ground,
                         const Executor& executor)
    : surface_(surface_to_cut(surface, finishing_ball(options).radius(), executor)) {
  const Tool* const large = larger_ball(options);
  if (large == nullptr) return;
  shared_ = std::make_unique<const Shared>(larger_surface(surface, *large, executor), *surface_,
                                           rows_of(options, ground, *large), executor);
}

std::vector<FinishPass> FinishBalls::passes(const CamOptions& options,
                                            const FinishGround& ground) const {
  const std::vector<RasterPlan> rasters = finish_rasters(options, ground);
  const Tool& ball = finishing_ball(options);
  if (!shared_) {
    std::vector<FinishPass> passes{{"finish", ball, surface_.get(), rasters.front()}};
    if (rasters.size() > 1) passes.push_back({"cross", ball, surface_.get(), rasters.back()});
    return passes;
  }
  const Tool& large = *larger_ball(options);
  RasterPlan small = rasters.front();
  RasterOptions rows = small.options;
  rows.pitch = rows.every * small.pitch;
  rows.every = 1;
  rows.rim_slope = kRimSlope;
  rows.shortest = shortest_move(options, large);
  std::vector<FinishPass> passes{{"large", large, &shared_->lifted_large,
                                  plan_finish_raster(ground.rectangle, large.radius(), rows)}};
  if (shared_->rest.share_within(0.0) == 0.0) return passes;
  small.rest = &shared_->rest;
  passes.push_back({"rest", ball, &shared_->lifted_small, small});
  return passes;
}

bool same_balls(const CamOptions& one, const CamOptions& other, const FinishGround& ground) {
  const auto key = [&](const CamOptions& options) {
    const Tool* const large = larger_ball(options);
    const double pitch = large == nullptr ? 0.0 : rows_of(options, ground, *large).pitch;
    return std::tuple(finishing_ball(options).radius(), large == nullptr ? 0.0 : large->radius(),
                      pitch, options.workshop.process.finish.large_every);
  };
  return key(one) == key(other);
}

namespace {

constexpr double kStretchError = 1e-6;  ///< mm; as of helices (BallPath::kHelixError).
constexpr double kLongestPart = 1.0;    ///< rad; of less than half a turn the sweep is known.

GcodeMotion straight(const Eigen::Vector3d& start, const Eigen::Vector3d& end) {
  GcodeMotion motion;
  motion.start = start;
  motion.end = end;
  motion.feed = 1.0;
  return motion;
}

GcodeMotion motion_of(const Eigen::Vector3d& start, const PathMove& move) {
  GcodeMotion motion = straight(start, move.end);
  if (move.arc_axis < 0) return motion;
  constexpr std::array<ArcPlane, 3> planes{ArcPlane::kYZ, ArcPlane::kZX, ArcPlane::kXY};
  const ArcRequest request{planes[static_cast<std::size_t>(move.arc_axis)], move.clockwise,
                           move.centre - start, std::nullopt};
  const ArcResult result = make_arc(start, move.end, request);
  LF_CHECK(result.reason.empty(), result.reason);
  motion.arc = result.arc;
  return motion;
}

/// The arc through three points in another one's plane, in its direction; straight if they are
/// collinear.
GcodeMotion through(const Eigen::Vector3d& start, const Eigen::Vector3d& middle,
                    const Eigen::Vector3d& end, const Arc& like) {
  GcodeMotion motion = straight(start, end);
  const auto flat = [&](const Eigen::Vector3d& point) {
    return Eigen::Vector2d(point[like.first] - start[like.first],
                           point[like.second] - start[like.second]);
  };
  const Eigen::Vector2d a = flat(middle);
  const Eigen::Vector2d b = flat(end);
  const double twice_area = a.x() * b.y() - a.y() * b.x();
  if (twice_area == 0.0) return motion;
  const Eigen::Vector2d centre =
      Eigen::Vector2d(b.y() * a.squaredNorm() - a.y() * b.squaredNorm(),
                      a.x() * b.squaredNorm() - b.x() * a.squaredNorm()) /
      (2.0 * twice_area);
  const double chord = std::min(1.0, 0.5 * b.norm() / centre.norm());
  Arc arc = like;
  arc.centre = start;
  arc.centre[like.first] += centre.x();
  arc.centre[like.second] += centre.y();
  arc.radius = centre.norm();
  arc.begin = std::atan2(-centre.y(), -centre.x());
  arc.sweep = std::copysign(2.0 * std::asin(chord), like.sweep);
  arc.rise = end[like.third] - start[like.third];
  motion.arc = arc;
  return motion;
}

/// Number of arcs through points of a stretched one that stay within kStretchError of it. With the
/// share e its curvature changes by at most 3 e / r² along it, so an arc of length l through its
/// ends and its middle is off by l³ / (72 √3) times that.
int parts_of(const Arc& arc, double share) {
  const double off = std::abs(share) * arc.radius / (24.0 * std::numbers::sqrt3);
  const double longest = std::min(kLongestPart, std::cbrt(kStretchError / off));
  return std::max(1, static_cast<int>(std::ceil(std::abs(arc.sweep) / longest)));
}

}  // namespace

void add_way(const RasterWay& way, const AxisStretch& stretch, BallPath& path) {
  Eigen::Vector3d at = way.start;
  for (const PathMove& move : way.moves) {
    add_stretched(motion_of(at, move), stretch, path);
    at = move.end;
  }
}

void add_row(const RasterRow& row, FinishPaths& paths) {
  add_way(row.exact, {}, paths.ideal.back());
  add_way(row.unrounded, {}, paths.fitted.back());
}

AxisStretch AxisStretch::of(const FinishProcess& finish) {
  return {finish.along == PassAxis::kX ? 1 : 0, 1.0 + finish.pitch_error};
}

void add_stretched(const GcodeMotion& motion, const AxisStretch& stretch, BallPath& path) {
  if (!stretch.any()) return path.add(motion);
  const auto made = [&](Eigen::Vector3d point) {
    point[stretch.axis] *= stretch.factor;
    return point;
  };
  if (motion.arc && motion.arc->third != stretch.axis) {
    const Arc& arc = *motion.arc;
    const int parts = parts_of(arc, stretch.factor - 1.0);
    for (int k = 0; k < parts; ++k) {
      const auto at = [&](double share) { return made(arc.at((k + share) / parts)); };
      path.add(through(at(0.0), at(0.5), at(1.0), arc));
    }
    return;
  }
  GcodeMotion whole = motion;
  whole.start = made(motion.start);
  whole.end = made(motion.end);
  if (whole.arc) whole.arc->centre = made(whole.arc->centre);
  path.add(whole);
}

MoveSink path_sink(BallPath& path, const AxisStretch& stretch) {
  return [&path, stretch,
          at = Eigen::Vector3d(Eigen::Vector3d::Zero())](std::span<const PathMove> moves) mutable {
    for (const PathMove& move : moves) {
      if (move.kind != MoveKind::kRapid) add_stretched(motion_of(at, move), stretch, path);
      at = move.end;
    }
  };
}

void read_path(const std::filesystem::path& program, const GcodeDialect& dialect, int tool,
               const std::function<void(const GcodeMotion&)>& take, const RunControl& control) {
  const auto pass_on = [&](const GcodeMotion& motion, int used) {
    if (!motion.rapid && (used == tool || used == 0)) take(motion);
  };
  read_program(program, dialect, pass_on, control);
}

}  // namespace lensforge
