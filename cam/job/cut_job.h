// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cam/job/job_files.h"
#include "cam/plan/cam_options.h"
#include "cam/plan/cut_plan.h"
#include "cam/plan/program_watch.h"
#include "cam/post/program_writer.h"
#include "cam/report/report_data.h"
#include "core/compute/executor.h"
#include "core/io/files.h"
#include "core/lens/lens.h"

namespace lensforge {

/// One part of a job. It is planned in a frame and on a blank of its own.
struct JobPart {
  const Lens* lens = nullptr;
  CamOptions options;
  std::filesystem::path folder;                      ///< For its report and prediction.
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();  ///< Its place in the programs, mm.
  std::string name = {};                             ///< On a shared blank; else empty.
};

/// A blank for several parts. Its lower left corner is X0 Y0 of the programs.
struct SharedBlank {
  Eigen::Vector3d size = Eigen::Vector3d::Zero();  ///< mm
  double z_offset = 0.0;                           ///< Program Z − lens-frame z, mm.
};

/// A blank with parts: one part, whose own blank it is, or a shared blank with any number of them.
struct CutJob {
  CamOptions options;  ///< Of the programs and of the machine, in the blank's frame.
  std::vector<JobPart> parts;
  std::optional<SharedBlank> shared;
  std::vector<const char*> beside;  ///< Names of the files that will be written beside programs.
};

/// A part as far as its programs: each value is a function of those before it.
struct PlannedPart {
  CutSetup setup;
  CutPasses passes;
  CutRecord record;
  ProgramPlan plan;
};

/// A job whose programs and reports are written under temporary names.
struct WrittenJob {
  std::vector<std::unique_ptr<PlannedPart>> parts;
  std::unique_ptr<ProgramChecks> checks;  ///< Of the whole blank.
  std::unique_ptr<PendingPrograms> programs;
  OtherPrograms others;             ///< Programs in the folder that the job did not write.
  std::vector<ReportData> reports;  ///< One for each part.
  std::vector<PendingFiles> files;  ///< The same: report and prediction.

  [[nodiscard]] std::vector<std::filesystem::path> program_paths() const;
};

/// Plans all parts, writes the programs, each operation of all parts before the next one begins,
/// and predicts and reports part after part. The same bytes for any number of threads.
/// @param job  must outlive the result, as must its lenses. @pre validate() passed for all parts.
/// @throw InputError as cut_setup(), cut_passes() and PendingPrograms; naming files that would be
///        replaced but were changed since, or were not written by a cut, without CamOptions::force.
/// @throw RunError if files cannot be written; Interrupted.
WrittenJob write_job(const CutJob& job, const std::filesystem::path& folder,
                     const Executor& executor, const RunControl& control);

/// Gives programs and reports their names and removes programs that an earlier job left.
/// @return all files, programs first. @throw RunError
std::vector<std::filesystem::path> publish(WrittenJob& job);

}  // namespace lensforge
