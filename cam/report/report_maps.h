// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "cam/report/report_data.h"
#include "core/image/image_io.h"

namespace lensforge {

/// The surface as relief, seen from above (+y up) and lit from the upper left; slopes are enlarged
/// until the usual ones are well seen. @param size  of the raster's rectangle, mm.
ColorImage relief_picture(const LensRaster& surface, const Eigen::Vector2d& size);

/// What a map's scale ends at: the 99.5th percentile of its values, 0.001 at least.
double scale_top(const std::vector<double>& values);

/// Values ≥ 0 in false colour without a legend, from 0 to `top`; columns × rows, row by row from
/// the top.
ColorImage scaled_picture(const std::vector<double>& values, int columns, int rows, double top);

/// A raster in false colour from `low` to `high`, +y up.
ColorImage raster_picture(const LensRaster& raster, double low, double high);

}  // namespace lensforge
