// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "cam/report/report_data.h"

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

}  // namespace lensforge
