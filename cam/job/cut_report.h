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
#include "core/surface/lens.h"

namespace lensforge {

/// What the machine must not do, whatever becomes of the light: collisions, ways down into material
/// that are too steep for their feed, motion below the blank or beyond the travel.
/// @pre the plan's programs were read back.
std::vector<LimitCheck> safety_checks(const CutPlan& plan);

/// The same in sentences; none where nothing was found.
std::vector<std::string> safety_warnings(const CutPlan& plan, const ProgramFiles& programs,
                                         const Lens& lens);

/// A blank that is as thin as the part allows, and the option that asks for it.
struct ThinBlank {
  std::string option;
  double thickness = 0.0;  ///< mm
};

/// Why the outline's tool touches the blank with what does not cut, ending with a tool or a blank
/// that would do; empty if it does not. @pre the plan cuts an outline.
std::string outline_tool_advice(const CutPlan& plan, double thickness, const ThinBlank& thin);

/// What the report says of a cut that was written. Without a prediction it has no pictures, and its
/// verdict judges the programs alone.
/// @throw InputError naming a limit that is negative or no number.
ReportData make_report(const CutPlan& plan, const ProgramFiles& programs,
                       const std::optional<Prediction>& prediction, const Lens& lens);

}  // namespace lensforge
