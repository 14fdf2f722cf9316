// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "cam/plan/cam_options.h"
#include "cam/report/report_data.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/compute/work_estimate.h"
#include "core/surface/lens.h"

namespace lensforge {

/// What is to be compared: every tool with every pitch, slope tolerance and larger ball.
struct CutChoices {
  std::vector<double> tools;    ///< Diameters of the finishing ball, mm; none: the workshop's.
  std::vector<double> pitches;  ///< mm; none: the workshop's.
  /// Numbers of the larger ball, 0 for no such; none: the workshop's.
  std::vector<int> large = {};
  std::vector<double> slopes = {};  ///< Slope tolerances, rad; none: the workshop's.
  double goal_mae = 0.0;  ///< Of the part: the quickest that reaches it is chosen; 0: none.
};

/// Combinations at most.
inline constexpr std::size_t kMaxChoices = 64;

/// Reads words such as "tool=0.3,0.4mm", "pitch=0.04", "large=0,4", "slope=3e-5" and "mae=0.004".
/// @param option  where they come from, for messages.
/// @throw InputError naming option, word and rule.
CutChoices parse_choices(std::span<const std::string> words, const std::string& option);

/// Where compare_cuts() writes its table.
inline constexpr const char* kComparePage = "compare.html";

struct CutComparison {
  bool complete = false;              ///< False if it was stopped.
  std::vector<ReportChoice> ranking;  ///< Least leakage first, then least hours; finishing only.
  /// What to take for CutChoices::goal_mae, or how close the best comes; empty without a goal.
  std::string advice;
  std::filesystem::path page;  ///< What was written; empty unless complete.
};

/// What a comparison takes: one combination is worked on after the other.
/// @throw InputError if an option breaks its rule in some combination, or disk or memory do not
///        hold it.
WorkEstimate require_room_for_comparison(const Lens& lens, const CamOptions& options,
                                         const CutChoices& choices,
                                         const std::filesystem::path& folder, int threads);

/// Plans, times and predicts the finishing of every combination as make_cut() does, and ranks
/// them. Programs are made in a folder of their own below `folder` and removed again. Roughing and
/// semi-finishing are left out: they are the same for all.
/// @throw InputError before any work if an option breaks its rule in some combination, or if there
///        is a page already that is not ours, without CamOptions::force; RunError.
CutComparison compare_cuts(const Lens& lens, const CamOptions& options, const CutChoices& choices,
                           const std::filesystem::path& folder, const Executor& executor,
                           const RunControl& control);

}  // namespace lensforge
