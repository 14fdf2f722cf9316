// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "cam/report/report_data.h"

namespace lensforge {

/// The report without its pictures, in the fields of report.json (lengths in mm, flux as shares,
/// infinite values as null): "z_offset", "verdict", "surfaces", "leakage", "places", "tools",
/// "operations", "setup", "parameters", "warnings", "choices", …
nlohmann::json report_json(const ReportData& data);

/// One line of the ranking of --compare.
nlohmann::json choice_json(const ReportChoice& choice);

}  // namespace lensforge
