// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/cam_job.h"

#include <chrono>
#include <optional>
#include <system_error>
#include <utility>

#include "cam/cut_plan.h"
#include "cam/cut_prediction.h"
#include "cam/cut_report.h"
#include "cam/job_files.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/pending_files.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

using Clock = std::chrono::steady_clock;

std::string names_of(const std::vector<fs::path>& paths) {
  std::string names;
  for (const fs::path& path : paths) {
    names += (names.empty() ? "" : ", ") + path.filename().string();
  }
  return names;
}

/// One run of make_cut().
class Job {
 public:
  Job(const Lens& lens, const CamOptions& options, fs::path folder, const Executor& executor,
      const RunControl& control)
      : lens_(lens),
        options_(options),
        folder_(std::move(folder)),
        executor_(executor.with_stop(control.stop_token())),
        control_(control),
        plan_(lens, options, executor_) {}

  CamResult run() {
    const Clock::time_point start = Clock::now();
    const ProgramPlan plan = plan_.programs(control_);
    const ProgramSettings settings = plan_.settings();
    require_replaceable_cut(folder_, programs_in_the_way(plan, options_.post, settings, folder_),
                            cut_file_names(options_), options_.force);
    PendingPrograms programs(plan, options_.post, settings, folder_, control_);
    std::optional<Prediction> prediction;
    if (options_.render) {
      prediction = predict_cut(plan_, lens_, programs.programs(), executor_, control_);
    }
    CamResult result;
    result.report = make_report(plan_, programs.programs(), prediction, lens_);
    const OtherPrograms others = other_programs(folder_, paths_of(programs.programs()));
    warn_of(others, result.report);
    result.report.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    PendingFiles files(folder_);
    if (prediction) add_prediction_files(*prediction, lens_, files);
    add_report_files(result.report, files);
    publish(programs, others, files, result);
    const Verdict& verdict = result.report.verdict;
    result.message = verdict_words(verdict.missed(), verdict.advice());
    return result;
  }

 private:
  static std::vector<fs::path> paths_of(const ProgramFiles& programs) {
    std::vector<fs::path> paths;
    for (const ProgramFile& file : programs.files) paths.push_back(file.path);
    return paths;
  }

  static void warn_of(const OtherPrograms& others, ReportData& report) {
    if (others.kept.empty()) return;
    report.warnings.push_back("the folder holds programs of another job, which were kept: " +
                              names_of(others.kept) + "; do not run them with it");
  }

  /// The old job goes and the new one comes, its report first and last, so that no report ever
  /// stands beside programs that it is not about.
  void publish(PendingPrograms& programs, const OtherPrograms& others, PendingFiles& files,
               CamResult& result) const {
    remove_prediction(folder_);
    programs.publish();
    for (const fs::path& path : others.earlier) {
      std::error_code ignored;
      fs::remove(path, ignored);
    }
    result.files = paths_of(programs.programs());
    for (const fs::path& path : files.publish()) result.files.push_back(path);
  }

  const Lens& lens_;
  const CamOptions& options_;
  fs::path folder_;
  Executor executor_;
  const RunControl& control_;
  CutPlan plan_;
};

}  // namespace

void remove_cut(const fs::path& folder) {
  remove_prediction(folder);
  std::error_code ignored;
  for (const fs::path& program : other_programs(folder, {}).earlier) fs::remove(program, ignored);
}

CamResult make_cut(const Lens& lens, const CamOptions& options, const fs::path& folder,
                   const Executor& executor, const RunControl& control) {
  validate(options, lens.setup);
  try {
    Job job(lens, options, folder, executor, control);
    require_writable_folder(folder);
    return job.run();
  } catch (const Interrupted&) {
    return {CamResult::Status::kInterrupted, "interrupted", {}, {}};
  }
}

}  // namespace lensforge
