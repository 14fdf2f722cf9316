// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cam/plan/cam_options.h"
#include "cam/report/report_data.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/compute/work_estimate.h"
#include "core/optics/optical_setup.h"
#include "core/surface/lens.h"

namespace lensforge {

/// Names of the files that make_cut() writes beside the programs.
namespace cam_file {
inline constexpr const char* kMilledMesh = "milled.ply";
inline constexpr const char* kMilledPicture = "milled.png";
inline constexpr const char* kLeakage = "leakage.png";
inline constexpr const char* kReport = "report.json";
inline constexpr const char* kPage = "report.html";
}  // namespace cam_file

/// What came out.
struct CamResult {
  enum class Status { kDone, kInterrupted };
  Status status = Status::kDone;
  std::string message;                       ///< Why it ended, in one line.
  std::vector<std::filesystem::path> files;  ///< What was written, programs first.
  ReportData report;                         ///< Empty if it was interrupted.

  [[nodiscard]] bool done() const { return status == Status::kDone; }
};

/// Makes everything that an operator needs to cut a lens: programs for roughing, semi-finishing and
/// finishing, the surface that they leave, the picture that the part will project, and the report.
/// All files are made beside their names and get them together in the end: what is interrupted or
/// fails before leaves the job of an earlier run as it was. Programs of an earlier run that this
/// one does not write are removed then; programs that were changed since, or are not the cut's, are
/// kept and named in the report. Same bytes for any number of threads.
/// @throw InputError naming option, value and rule if an option breaks its rule; naming the surface
///        if it has no triangles, is no height field over the lens's rectangle or does not cover
///        it; naming files that would be replaced though no cut wrote them as they stand, without
///        CamOptions::force.
/// @throw RunError if the files cannot be written (disk full, …).
CamResult make_cut(const Lens& lens, const CamOptions& options, const std::filesystem::path& folder,
                   const Executor& executor, const RunControl& control);

/// Removes what make_cut() wrote into a folder and nobody changed since; other files stay.
void remove_cut(const std::filesystem::path& folder);

/// What make_cut() is about to take: time, bytes of programs, and memory for the ways of the
/// finishing ball where the part is rendered. From area, pitch, tolerances, passes and sample
/// spacing alone, so good to a factor of three or so: surfaces differ in how often they bend.
/// @param threads  that work at the same time, ≥ 1. @pre validate() passed.
WorkEstimate estimate_cut(const CamOptions& options, const OpticalSetup& setup, int threads);

/// More than anybody waits for or a controller stores: six weeks of one processor core, 100 GB.
inline constexpr double kMaxCutSeconds = 1000.0 * 3600.0;
inline constexpr double kMaxCutBytes = 1e11;

/// @throw InputError naming --pitch, --sample-spacing or what else asks for most, and a value that
///        would fit, if the disk of `folder` or the memory do not hold what the cut takes, or if it
///        takes more than kMaxCutSeconds of one core or kMaxCutBytes of programs.
void require_room_for_cut(const CamOptions& options, const OpticalSetup& setup,
                          const WorkEstimate& estimate, const std::filesystem::path& folder);

}  // namespace lensforge
