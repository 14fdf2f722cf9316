// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cam/plan/cam_options.h"
#include "cam/plan/cut_plan.h"
#include "cam/post/program_writer.h"
#include "cam/predict/prediction.h"
#include "cam/report/report_data.h"
#include "cam/report/verdict.h"
#include "core/lens/lens.h"

namespace lensforge {

/// Checks of what the machine must not do: collisions, descents too steep for their feed, motion
/// below the blank or beyond the travel.
/// @pre the plan's programs were read back.
std::vector<LimitCheck> safety_checks(const CutPlan& plan);

/// The same in sentences; empty if nothing was found.
std::vector<std::string> safety_warnings(const CutPlan& plan, const ProgramFiles& programs,
                                         const Lens& lens);

/// The thinnest blank that the part allows, and its option.
struct ThinBlank {
  std::string option;
  double thickness = 0.0;  ///< mm
};

/// Explains why a part of the outline's tool that does not cut touches the blank, ending with a
/// tool or a blank that works; empty if none touches. @pre the plan cuts an outline.
std::string outline_tool_advice(const CutPlan& plan, double thickness, const ThinBlank& thin);

/// The report of a written cut. Without a prediction it has no pictures, and its verdict judges the
/// programs alone.
/// @throw InputError naming a limit that is negative or no number.
ReportData make_report(const CutPlan& plan, const ProgramFiles& programs,
                       const std::optional<Prediction>& prediction, const Lens& lens);

}  // namespace lensforge
