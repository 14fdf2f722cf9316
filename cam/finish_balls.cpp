// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/finish_balls.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "cam/meant_surface.h"
#include "core/error.h"

namespace lensforge {
namespace {

/// Slope up to which the larger ball finishes a surface to its rim, rise over run: what is steeper
/// there it leaves.
constexpr double kRimSlope = 0.4;

std::unique_ptr<CutSurface> larger_surface(const std::shared_ptr<const OpticalSurface>& surface,
                                           const Tool& ball, const Executor& executor) {
  if (surface->has_creases()) {
    throw InputError("finish.large_tool " + std::to_string(ball.number) +
                     ": needs a surface without creases; use --surface smooth");
  }
  return surface_to_cut(surface, ball.radius(), executor);
}

BallBlend::Rows rows_of(const CamOptions& options, const Tool& large) {
  const FinishProcess& finish = options.workshop.process.finish;
  const double radius = finishing_ball(options).radius();
  return {radius, large.radius(), finish_pitch(finish, radius), finish.large_every};
}

}  // namespace

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
                         const CamOptions& options, const Executor& executor)
    : surface_(surface_to_cut(surface, finishing_ball(options).radius(), executor)) {
  const Tool* const large = larger_ball(options);
  if (large == nullptr) return;
  shared_ = std::make_unique<const Shared>(larger_surface(surface, *large, executor), *surface_,
                                           rows_of(options, *large), executor);
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

bool same_balls(const CamOptions& one, const CamOptions& other) {
  const auto key = [](const CamOptions& options) {
    const Tool* const large = larger_ball(options);
    const double pitch = large == nullptr ? 0.0 : rows_of(options, *large).pitch;
    return std::tuple(finishing_ball(options).radius(), large == nullptr ? 0.0 : large->radius(),
                      pitch, options.workshop.process.finish.large_every);
  };
  return key(one) == key(other);
}

}  // namespace lensforge
