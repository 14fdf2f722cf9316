// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "core/compute/executor.h"
#include "core/optics/optical_setup.h"
#include "core/spline/control_net.h"

namespace lensforge {

/// render_flux() of a spline by its own normals at the nodes of its picture, picture_nodes(), which
/// are not kept: strip by strip, the same picture to rounding in the light of a point, else to the
/// bit.
std::vector<double> render_spline(const ControlNet& net, const OpticalSetup& setup,
                                  const Executor& executor);

/// The same with so many nodes a knot cell each way.
std::vector<double> render_spline(const ControlNet& net, int samples, const OpticalSetup& setup,
                                  const Executor& executor);

}  // namespace lensforge
