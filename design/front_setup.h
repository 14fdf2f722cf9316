// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include "core/compute/executor.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// The height map of `--front FILE`. @throw InputError naming the file and what is wrong with it,
/// or the option if there is none.
std::shared_ptr<const HeightSpline> front_from(const std::string& file, const RunControl& control);

/// True if light comes to every point of two start surfaces, `thickness` high and kStartRise times
/// the front's depth more, and gets out, and no part of the front is shaded. Looked at on a raster.
/// @param depth  between the front's highest and lowest point, mm. @param cells  each way.
bool start_works(const OpticalSetup& setup, double thickness, double depth, int cells);

/// @param given  the option as it was written.
/// @throw InputError naming option, value and rule if the front of setup, a height map, leaves less
///        than the thickness, folds its light, or is too steep for it.
void require_height_map(const OpticalSetup& setup, double thickness, const std::string& given);

}  // namespace lensforge
