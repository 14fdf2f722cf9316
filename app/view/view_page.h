// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "app/view/lens_view.h"

namespace lensforge {

/// The page that shows a lens: one HTML file that needs nothing from outside and draws the lens's
/// light itself.
std::string view_page(const LensView& view);

}  // namespace lensforge
