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
std::string maps(const ReportData& data);
std::string view(const ReportData& data);
std::string choices(const ReportData& data);
std::string parameters(const ReportData& data);
std::string footer(const ReportData& data);

}  // namespace lensforge::report_section
