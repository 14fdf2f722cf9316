// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "cam/report/report_data.h"

namespace lensforge {

/// The operator's report as one HTML file that needs nothing else: pictures are data URIs, style
/// and script stand inside. All text of `data` is escaped. First screen: verdict, pictures, worst
/// places, minutes, tools; what `data` leaves empty is left out.
std::string report_html(const ReportData& data);

/// A page of the choices alone.
std::string compare_html(const ReportData& data);

}  // namespace lensforge
