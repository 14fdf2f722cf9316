// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance_run.h"

#include <algorithm>
#include <optional>

#include "cam/finish_setup.h"

namespace lensforge {
namespace {

/// The rows as they lie on the lens: a mould is larger by what its cast shrinks.
Passes passes_of(const CamOptions& options, const CutPlan& plan) {
  const FinishProcess& finish = options.workshop.process.finish;
  const std::optional<CastFrame> mould = plan.mould();
  const double scale = mould ? mould->scale : 1.0;
  Passes passes;
  passes.pitch = plan.pitch() / scale;
  passes.ball_radius = finishing_ball(options).radius() / scale;
  passes.axis = finish.along == PassAxis::kX ? 0 : 1;
  passes.zigzag = finish.style == PassStyle::kZigzag;
  passes.cross = finish.cross;
  passes.cast = mould.has_value();
  return passes;
}

}  // namespace

PartPlan part_plan(const CamOptions& options, const Lens& lens, const CutPlan& plan) {
  const Workshop& shop = options.workshop;
  return {lens.setup, passes_of(options, plan), shop.polish,
          shop.polish.sigma * (1.0 + kSigmaBound * shop.tolerances.polish_sigma)};
}

ToleranceForecast draw_parts(const ToleranceSite& site, const Executor& executor,
                             const RunControl& control) {
  const CamOptions& options = site.plan.options();
  const PartPlan plan = part_plan(options, site.lens, site.plan);
  const PartModel model(site.surfaces.milled(), site.surfaces.designed(), plan, executor, control);
  const ErrorSource source{options.workshop.tolerances, site.lens.setup.lens_size, plan.passes,
                           static_cast<std::uint64_t>(options.tolerance_seed)};
  const PictureJudge judge(site.lens.target, site.designed, options.leakage);
  return forecast_parts(model, source, judge, options.tolerances, executor, control);
}

}  // namespace lensforge
