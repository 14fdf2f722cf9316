// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "app/view/lens_view.h"

namespace lensforge {

/// Returns the page that shows a lens: one self-contained HTML file that computes the projected
/// picture itself.
std::string view_page(const LensView& view);

}  // namespace lensforge
