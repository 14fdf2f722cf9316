// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/objective.h"

namespace lensforge {

AreaBarrier default_area_barrier(const OpticalSetup& setup, std::int64_t triangles, double least) {
  const double mean = setup.lens_size.prod() / static_cast<double>(triangles);
  return {least * mean, 5.0 * least * mean};
}

template class DesignObjectiveOn<Executor>;

}  // namespace lensforge
