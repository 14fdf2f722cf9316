// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "cam/cam_options.h"
#include "cam/finish_setup.h"
#include "cam/milled/lens_grid.h"

namespace lensforge {

/// Nodes from one finishing pass to the next, even. @param most  distance of two at most, mm.
double nodes_per_pass(double pitch, double most);

/// The grid on which the surfaces of a part are rendered: nodes at most sample_spacing() apart, and
/// across finishing passes an even number of them from one pass to the next.
///
/// Where the spacing does not divide the pitch, every pass is sampled at other places of its
/// scallop than the next, and the harmonic of the scallops that is closest to the sampling
/// frequency comes back as a wave of a few passes that polishing does not take away: at a pitch of
/// 0.045 mm, nodes 0.01 mm apart predict twice the leakage. An even number stays whole at half the
/// pitch.
/// @param ground  of what is cut: in a mould the passes lie closer on the lens by its shrinkage.
/// @param size    of the lens, mm.
GridWindow sampling_grid(const CamOptions& options, const FinishGround& ground,
                         const Eigen::Vector2d& size);

}  // namespace lensforge
