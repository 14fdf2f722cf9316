// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>

#include "cam/report/report_data.h"
#include "core/image/image_io.h"

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
std::string certificates(const ReportData& data);
std::string leakage(const ReportData& data);
std::string tolerances(const ReportData& data);
std::string maps(const ReportData& data);
std::string view(const ReportData& data);
std::string choices(const ReportData& data);
std::string parameters(const ReportData& data);
std::string footer(const ReportData& data);

/// Blank, part, clamps and program zero from above and from the front, as SVG.
std::string setup_drawing(const SetupSheet& setup, bool from_above);

}  // namespace lensforge::report_section
