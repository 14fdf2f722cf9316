// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "core/executor.h"
#include "design/energy/picture_error.h"

namespace lensforge {

/// E_grad = ‖G_x − G̃_x‖² + ‖G_y − G̃_y‖² with forward differences between neighbouring pixels
/// (Sun et al., Eq. 6). Adds weight × ∂E/∂g to `g_bar`, returns E.
double gradient_term(const Executor& executor, const PictureError& picture, double weight,
                     std::span<double> g_bar);

}  // namespace lensforge
