// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "app/console.h"
#include "core/surface/lens.h"

namespace lensforge::app {

/// Tells the reader if the design of the lens was interrupted.
void note_unfinished_design(const Lens& lens, const Console& console);

}  // namespace lensforge::app
