// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>

#include "cam/leakage/render_field.h"
#include "cam/milled/surface_field.h"
#include "cam/tolerance/part_error.h"
#include "cam/tolerance/part_heights.h"
#include "cam/tolerance/part_light.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// Nominal values that the programs assume.
struct PartPlan {
  OpticalSetup optics;
  Passes passes;
  PolishModel polish;
  double largest_sigma = 0.0;  ///< Of the polish, with errors, mm, ≥ polish.sigma.
};

/// Predicts the pictures of many parts with errors from one sampling of the surface as cut.
/// Polishing removes everything finer than its σ except the scallops' ripple. So the heights
/// without scallops (BaseHeights), changed by the part's errors (ErrorHeights), are polished on a
/// grid as coarse as σ allows; the ripple (Ripple) is added where rays land, with four nodes per
/// pitch, and the source blurs the picture. The PartModel.* tests compare it with cam's own chain
/// of surfaces.
class PartModel {
 public:
  /// @param cut, designed  as in BaseHeights::sample(); used only during construction.
  /// @throw Interrupted
  PartModel(const SurfaceField& cut, const SurfaceField& designed, const PartPlan& plan,
            const Executor& executor, const RunControl& control);

  /// The picture of one part; same bits for any number of threads. @throw Interrupted
  [[nodiscard]] FluxPicture render(const PartError& error, const Executor& executor) const;

  [[nodiscard]] const PartPlan& plan() const { return plan_; }

 private:
  PartPlan plan_;
  BaseHeights base_;
  double mean_height_;  ///< mm
  PartNodes lit_;
};

/// Number of nodes of the grid on which a part is rendered; time and memory depend on it.
std::int64_t part_nodes(const PartPlan& plan);

}  // namespace lensforge
