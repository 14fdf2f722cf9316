// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "cam/cam_options.h"
#include "cam/cut_plan.h"
#include "cam/post/program_writer.h"
#include "cam/prediction.h"
#include "cam/report/report_data.h"
#include "core/surface/lens.h"

namespace lensforge {

/// What the report says of a cut that was written. Without a prediction it has no pictures, and its
/// verdict judges the programs alone.
/// @throw InputError naming a limit that is negative or no number.
ReportData make_report(const CutPlan& plan, const ProgramFiles& programs,
                       const std::optional<Prediction>& prediction, const Lens& lens);

}  // namespace lensforge
