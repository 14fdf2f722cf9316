// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "cam/report/report_data.h"
#include "core/image/image_io.h"

namespace lensforge {

/// The operator's report as one HTML file that needs nothing else: pictures are data URIs, style
/// and script stand inside. All text of `data` is escaped. First screen: verdict, pictures, worst
/// places, minutes, tools; what `data` leaves empty is left out.
std::string report_html(const ReportData& data);

/// The section that shows the surface and the paths of `data` in three dimensions, and the script
/// that draws it; for other pages, too.
std::string surface_view_html(const ReportData& data);
std::string_view surface_view_script();

/// A page of the choices alone.
std::string compare_html(const ReportData& data);

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

/// The report's sections as HTML; each is empty where its data is.
namespace lensforge::report_section {

std::string header(const ReportData& data);
std::string pictures(const ReportData& data);
std::string verdict(const ReportData& data);
std::string places(const ReportData& data);
std::string work(const ReportData& data);  ///< Minutes and tools.

std::string warnings(const ReportData& data);
std::string setup(const ReportData& data);
std::string light(const ReportData& data);  ///< Lamp, part and screen.
std::string operations(const ReportData& data);
std::string polish(const ReportData& data);
std::string certificates(const ReportData& data);
std::string leakage(const ReportData& data);
std::string tolerances(const ReportData& data);
std::string faces(const ReportData& data);
std::string maps(const ReportData& data);
std::string view(const ReportData& data);
std::string choices(const ReportData& data);
std::string parameters(const ReportData& data);
std::string footer(const ReportData& data);

}  // namespace lensforge::report_section
