// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/job/cut_job.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include "cam/contact/profile_cutter.h"
#include "cam/job/cut_report.h"
#include "cam/path/rough.h"
#include "cam/predict/part_surfaces.h"
#include "cam/predict/prediction.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

// Every part is planned on its own blank. On a shared one that is its rectangle and a margin so
// wide that no roughing breaks out of it, at the height of the common blank: the parts' blanks
// overlap, and material that one part has cleared of its neighbour's counts as still there. The
// effect of the programs on the common blank is checked as a whole (ProgramChecks), including
// table, clamps and travel.
namespace lensforge {
namespace {

namespace fs = std::filesystem;

using Clock = std::chrono::steady_clock;

/// Cells of a shared blank's model, mm, and their maximum number along its longer side.
constexpr double kStockCell = 0.1;
constexpr double kMaxCells = 2000.0;

using Parts = std::vector<std::unique_ptr<PlannedPart>>;

/// An operation of one part among those of the job.
struct Step {
  std::size_t part = 0;
  std::size_t operation = 0;  ///< In the part's own plan.
  WatchedOperation watched;
};

std::unique_ptr<PlannedPart> plan_part(const JobPart& part, const Executor& executor,
                                       const RunControl& control) {
  CutSetup setup = cut_setup(*part.lens, part.options);
  CutPasses passes = cut_passes(setup, executor);
  CutRecord record(setup);
  auto planned = std::make_unique<PlannedPart>(
      PlannedPart{std::move(setup), std::move(passes), std::move(record), {}});
  planned->plan =
      plan_programs(planned->setup, planned->passes, planned->record, executor, control);
  return planned;
}

/// The surfaces of all parts, as they are cut, in one mesh, each in its place.
SurfaceMesh all_surfaces(const CutJob& job, const Parts& parts) {
  SurfaceMesh all;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const SurfaceMesh& mesh = parts[k]->setup.mesh();
    const Eigen::Index vertices = all.vertices.cols();
    const Eigen::Index triangles = all.triangles.cols();
    all.vertices.conservativeResize(3, vertices + mesh.vertices.cols());
    all.triangles.conservativeResize(3, triangles + mesh.triangles.cols());
    auto moved = all.vertices.rightCols(mesh.vertices.cols());
    moved = mesh.vertices;
    moved.topRows<2>().colwise() += job.parts[k].corner;
    all.triangles.rightCols(mesh.triangles.cols()) =
        mesh.triangles.array() + static_cast<int>(vertices);
  }
  return all;
}

std::unique_ptr<ProgramChecks> checks_of(const CutJob& job, const Parts& parts) {
  if (!job.shared) {
    const PlannedPart& part = *parts.front();
    return std::make_unique<ProgramChecks>(part.passes.profile, part.setup.options.workshop,
                                           part.record.stock, part.setup.z_offset);
  }
  const Eigen::Vector3d& size = job.shared->size;
  const Eigen::AlignedBox3d box(Eigen::Vector3d::Zero(), size);
  const double cell = std::max(kStockCell, size.head<2>().maxCoeff() / kMaxCells);
  return std::make_unique<ProgramChecks>(
      std::make_shared<const ProfileCutter>(all_surfaces(job, parts)), job.options.workshop,
      StockMap(box, cell), job.shared->z_offset);
}

WatchedOperation watched(const CutJob& job, const JobPart& part, const PlannedPart& planned,
                         const ProgramOperation& operation) {
  WatchedOperation watched{operation.name, operation.tool,
                           descent_rule(job.options.workshop.process, operation.name)};
  if (!job.shared) return watched;
  watched.name += " of " + part.name;
  const Eigen::AlignedBox2d cut = planned.setup.cut_rectangle();
  watched.rule.rim = {Eigen::Vector2d(cut.min() + part.corner),
                      Eigen::Vector2d(cut.max() + part.corner)};
  return watched;
}

/// All of one operation, part after part, then all of the next.
std::vector<Step> steps_of(const CutJob& job, const Parts& parts) {
  std::vector<Step> steps;
  std::size_t count = 0;
  for (const auto& part : parts) count += part->plan.operations.size();
  for (const std::string_view name : kOperationNames) {
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const std::vector<ProgramOperation>& operations = parts[k]->plan.operations;
      for (std::size_t i = 0; i < operations.size(); ++i) {
        if (operations[i].name != name) continue;
        steps.push_back({k, i, watched(job, job.parts[k], *parts[k], operations[i])});
      }
    }
  }
  LF_CHECK(count == steps.size(), "an operation without a place in the order");
  return steps;
}

std::string place_words(const CutJob& job, std::size_t k) {
  const JobPart& part = job.parts[k];
  return "lens " + std::to_string(k + 1) + " of " + std::to_string(job.parts.size()) + ", X " +
         trimmed_decimal(part.corner.x(), 2) + " Y " + trimmed_decimal(part.corner.y(), 2) + ": " +
         part.name;
}

/// Moves shifted to their place on the blank.
MoveSink shifted(const MoveSink& sink, const Eigen::Vector2d& by) {
  return [sink, by, held = std::vector<PathMove>()](std::span<const PathMove> moves) mutable {
    held.assign(moves.begin(), moves.end());
    for (PathMove& move : held) {
      move.end.head<2>() += by;
      move.centre.head<2>() += by;
    }
    sink(held);
  };
}

/// A part's operation in its place on a shared blank.
ProgramOperation placed(ProgramOperation operation, const CutJob& job, std::size_t k) {
  operation.comments.insert(operation.comments.begin(), place_words(job, k));
  operation.stream = [stream = operation.stream, corner = job.parts[k].corner](
                         const MoveSink& sink) { return stream(shifted(sink, corner)); };
  return operation;
}

ProgramPlan whole_plan(const CutJob& job, const Parts& parts, const std::vector<Step>& steps) {
  ProgramPlan whole = parts.front()->plan;
  whole.operations.clear();
  for (const Step& step : steps) {
    const ProgramOperation& operation = parts[step.part]->plan.operations[step.operation];
    whole.operations.push_back(job.shared ? placed(operation, job, step.part) : operation);
  }
  if (!job.shared) return whole;
  whole.job = job.options.job;
  whole.comments.front() = "units: mm; X0 Y0: lower left corner of the blank";
  for (std::size_t k = 0; k < parts.size(); ++k) whole.comments.push_back(place_words(job, k));
  return whole;
}

void require_replaceable(const CutJob& job, const ProgramPlan& whole,
                         const ProgramSettings& settings, const fs::path& folder) {
  const CamOptions& options = job.options;
  require_replaceable_cut(folder, programs_in_the_way(whole, options.post, settings, folder),
                          job.beside, options.force);
  for (const JobPart& part : job.parts) {
    if (part.folder == folder) continue;
    require_replaceable_cut(part.folder, {}, cut_file_names(options), options.force);
  }
}

/// The programs, with one part's operations alone.
ProgramFiles programs_of(std::size_t part, const std::vector<Step>& steps,
                         const ProgramFiles& all) {
  ProgramFiles own;
  own.names = all.names;
  own.reader = all.reader;
  std::vector<std::optional<std::size_t>> numbers(steps.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i].part != part) continue;
    numbers[i] = own.summaries.size();
    own.summaries.push_back(all.summaries[i]);
    own.times.push_back(all.times[i]);
    own.total += all.times[i];
  }
  for (WrittenProgram file : all.files) {
    std::vector<OperationTime> kept;
    for (OperationTime time : file.operations) {
      if (!numbers[time.operation]) continue;
      time.operation = *numbers[time.operation];
      kept.push_back(time);
    }
    file.operations = std::move(kept);
    if (!file.operations.empty()) own.files.push_back(std::move(file));
  }
  return own;
}

std::optional<Prediction> predict(PlannedPart& part, const PartPrograms& programs,
                                  const Executor& executor, const RunControl& control) {
  if (!part.setup.options.render) return std::nullopt;
  FinishPaths paths =
      finish_paths(part.setup, part.passes, std::move(part.record.rows), programs, control);
  const CutSurfaces surfaces(part.setup, part.passes, std::move(paths), executor);
  return predict_cut(part.setup, part.passes, surfaces, executor, control);
}

std::string names_of(const std::vector<fs::path>& paths) {
  std::string names;
  for (const fs::path& path : paths) names = with_word(names, path.filename().string());
  return names;
}

/// For the report of a blank's only part; a nest warns once for all its parts.
void warn_of(const OtherPrograms& others, ReportData& report) {
  if (others.kept.empty()) return;
  report.warnings.push_back("the folder holds programs of another job, which were kept: " +
                            names_of(others.kept) + "; do not run them with it");
}

/// How a job runs.
struct Run {
  const CutJob& job;
  const Executor& executor;
  const RunControl& control;
  Clock::time_point start = Clock::now();
};

/// Predicts and reports one part. @param own  the programs with its operations alone.
void add_report(const Run& run, std::size_t k, const ProgramFiles& own, WrittenJob& written) {
  const CutJob& job = run.job;
  const JobPart& part = job.parts[k];
  PlannedPart& planned = *written.parts[k];
  const std::optional<Prediction> prediction =
      predict(planned, {own, part.corner}, run.executor, run.control);
  ReportData report = make_report({planned.setup, planned.passes, planned.record, *written.checks,
                                   own, part.corner, job.shared.has_value()},
                                  prediction);
  if (!job.shared) warn_of(written.others, report);
  report.seconds = std::chrono::duration<double>(Clock::now() - run.start).count();
  require_writable_folder(part.folder);
  PendingFiles& files = written.files.emplace_back(part.folder);
  if (prediction) add_prediction_files(*prediction, *part.lens, files);
  add_report_files(report, files);
  written.reports.push_back(std::move(report));
}

}  // namespace

std::vector<fs::path> WrittenJob::program_paths() const {
  std::vector<fs::path> paths;
  for (const WrittenProgram& file : programs->programs().files) paths.push_back(file.path);
  return paths;
}

WrittenJob write_job(const CutJob& job, const fs::path& folder, const Executor& own_executor,
                     const RunControl& control) {
  const Executor executor = own_executor.with_stop(control.stop_token());
  WrittenJob written;
  for (const JobPart& part : job.parts) {
    written.parts.push_back(plan_part(part, executor, control));
  }
  written.checks = checks_of(job, written.parts);
  require_writable_folder(folder);
  const Run run{job, executor, control};
  const std::vector<Step> steps = steps_of(job, written.parts);
  const ProgramPlan whole = whole_plan(job, written.parts, steps);
  ProgramSettings settings = program_settings(written.parts.front()->setup.options);
  settings.look = [&](std::size_t operation, const ProgramLine& line) {
    written.checks->take(steps[operation].watched, line);
  };
  require_replaceable(job, whole, settings, folder);
  written.programs =
      std::make_unique<PendingPrograms>(whole, job.options.post, settings, folder, control);
  written.others = other_programs(folder, written.program_paths());
  const ProgramFiles& all = written.programs->programs();
  for (std::size_t k = 0; k < job.parts.size(); ++k) {
    const ProgramFiles own = job.shared ? programs_of(k, steps, all) : all;
    add_report(run, k, own, written);
  }
  return written;
}

std::vector<fs::path> publish(WrittenJob& job) {
  job.programs->publish();
  for (const fs::path& path : job.others.earlier) {
    std::error_code ignored;
    fs::remove(path, ignored);
  }
  std::vector<fs::path> all = job.program_paths();
  for (PendingFiles& files : job.files) {
    for (const fs::path& path : files.publish()) all.push_back(path);
  }
  return all;
}

}  // namespace lensforge
