// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "cam/report/report_data.h"
#include "core/image/image_io.h"

namespace lensforge {

/// The surface as relief, seen from above (+y up) and lit from the upper left; slopes are
/// exaggerated until typical ones are visible. @param size  of the raster's rectangle, mm.
ColorImage relief_picture(const LensRaster& surface, const Eigen::Vector2d& size);

/// Upper end of a map's scale: the 99.5th percentile of its values, at least 0.001.
double scale_top(const std::vector<double>& values);

/// Values ≥ 0 in false colour without a legend, from 0 to `top`; columns × rows, row by row from
/// the top.
ColorImage scaled_picture(const std::vector<double>& values, int columns, int rows, double top);

/// A raster in false colour from `low` to `high`, +y up.
ColorImage raster_picture(const LensRaster& raster, double low, double high);

}  // namespace lensforge
