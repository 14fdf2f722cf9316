// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cam/cam_options.h"
#include "cam/contact/ball_blend.h"
#include "cam/contact/cut_surface.h"
#include "cam/finish_setup.h"
#include "cam/path/finish_raster.h"
#include "core/compute/executor.h"
#include "core/surface/optical_surface.h"

namespace lensforge {

/// One finishing raster.
struct FinishPass {
  std::string name;  ///< "finish", "cross", "large" or "rest": OperationSummary::name.
  Tool tool;         ///< A ball.
  const CutSurface* surface = nullptr;
  RasterPlan plan;
};

/// The ball, or the two, that finish a surface.
class FinishBalls {
 public:
  /// @throw InputError naming finish.large_tool if a larger ball is asked for and the surface has
  ///        creases.
  FinishBalls(const std::shared_ptr<const OpticalSurface>& surface, const CamOptions& options,
              const Executor& executor);
  FinishBalls(const FinishBalls&) = delete;
  FinishBalls& operator=(const FinishBalls&) = delete;

  /// For the finishing ball on its own.
  [[nodiscard]] const CutSurface& surface() const { return *surface_; }
  /// What the larger ball leaves, if there is one.
  [[nodiscard]] const RestMap* rest() const { return shared_ ? &shared_->rest : nullptr; }
  /// In the order in which they are cut. @pre `options` have the same balls, pitch and rows.
  [[nodiscard]] std::vector<FinishPass> passes(const CamOptions& options,
                                               const FinishGround& ground) const;

 private:
  struct Shared {
    Shared(std::unique_ptr<CutSurface> larger, const CutSurface& smaller,
           const BallBlend::Rows& rows, const Executor& executor);

    std::unique_ptr<CutSurface> large;
    RestMap rest;
    BallBlend blend;
    SharedLift small_lift;
    SharedLift large_lift;
    LiftedSurface lifted_small;
    LiftedSurface lifted_large;
  };

  std::unique_ptr<CutSurface> surface_;
  std::unique_ptr<const Shared> shared_;
};

/// Whether balls for one set of options cut a surface for the other as well.
bool same_balls(const CamOptions& one, const CamOptions& other);

}  // namespace lensforge
