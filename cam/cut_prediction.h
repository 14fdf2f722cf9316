// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "cam/cut_plan.h"
#include "cam/post/program_writer.h"
#include "cam/prediction.h"
#include "cam/report/report_data.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/io/pending_files.h"
#include "core/surface/lens.h"

namespace lensforge {

/// What a lens will project whose programs are written, with remedies and tolerances as its options
/// ask for them. Takes the plan's finishing paths.
/// @param programs  with this plan's operations alone. @throw Interrupted
Prediction predict_cut(CutPlan& plan, const Lens& lens, const ProgramFiles& programs,
                       const Executor& executor, const RunControl& control);

/// What a cut writes beside its programs.
std::vector<const char*> cut_file_names(const CamOptions& options);

/// The milled surface and the pictures.
void add_prediction_files(const Prediction& prediction, const Lens& lens, PendingFiles& files);

/// The report as page and as JSON.
void add_report_files(const ReportData& report, PendingFiles& files);

/// Removes from a folder what an earlier run predicted.
void remove_prediction(const std::filesystem::path& folder);

}  // namespace lensforge
