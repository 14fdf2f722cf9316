// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "cam/plan/cut_plan.h"
#include "cam/plan/program_watch.h"
#include "cam/post/program_writer.h"
#include "cam/predict/prediction.h"
#include "cam/report/report_data.h"
#include "cam/report/verdict.h"
#include "core/lens/lens.h"

namespace lensforge {

/// A part whose programs are written: all that its report is about.
struct WrittenCut {
  const CutSetup& setup;
  const CutPasses& passes;
  const CutRecord& record;
  const ProgramChecks& checks;                       ///< Of the whole blank.
  const ProgramFiles& programs;                      ///< With this part's operations alone.
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();  ///< The part's place in the programs, mm.
  bool shared = false;                               ///< The blank holds other parts, too.
};

/// The thinnest blank that the part allows, and its option.
struct ThinBlank {
  std::string option;
  double thickness = 0.0;  ///< mm
};

/// Explains why a part of the outline's tool that does not cut touches the blank, ending with a
/// tool or a blank that works; empty if none touches. @pre the setup cuts an outline.
std::string outline_tool_advice(const CutSetup& setup, const ProgramChecks& checks,
                                double thickness, const ThinBlank& thin);

/// The report of a written cut. Without a prediction it has no pictures, and its verdict judges the
/// programs alone.
/// @throw InputError naming a limit that is negative or no number.
ReportData make_report(const WrittenCut& cut, const std::optional<Prediction>& prediction);

}  // namespace lensforge
