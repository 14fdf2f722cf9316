// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/sampling_grid.h"

#include <cmath>

namespace lensforge {

double nodes_per_pass(double pitch, double most) {
  return 2.0 * std::ceil(0.5 * pitch / most * (1.0 - 1e-9));
}

GridWindow sampling_grid(const CamOptions& options, const FinishGround& ground,
                         const Eigen::Vector2d& size) {
  const double most = sample_spacing(options);
  Eigen::Vector2d spacing = Eigen::Vector2d::Constant(most);
  for (const RasterPlan& plan : finish_rasters(options, ground)) {
    const int across = 1 - plan.options.along;
    // Passes from rim to rim of what is cut are passes from rim to rim of the lens.
    const double steps = std::round(plan.surface.sizes()[across] / plan.pitch);
    const double pitch = size[across] / steps;
    spacing[across] = pitch / nodes_per_pass(pitch, most);
  }
  return lens_grid(size, spacing);
}

}  // namespace lensforge
