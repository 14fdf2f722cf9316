// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "core/executor.h"
#include "design/energy/picture_error.h"

namespace lensforge {

/// E_img = Σ (g − g̃)² (Sun et al., Eq. 5). Adds weight × ∂E/∂g to `g_bar`, returns E.
double image_term(const Executor& executor, const PictureError& picture, double weight,
                  std::span<double> g_bar);

}  // namespace lensforge
