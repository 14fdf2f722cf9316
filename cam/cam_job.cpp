// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/cam_job.h"

#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "cam/cut_plan.h"
#include "cam/cut_report.h"
#include "cam/job_files.h"
#include "cam/meant_surface.h"
#include "cam/part_layers.h"
#include "cam/part_surfaces.h"
#include "cam/prediction.h"
#include "cam/remedies.h"
#include "cam/report/report_html.h"
#include "cam/report/report_json.h"
#include "cam/tolerance_run.h"
#include "core/error.h"
#include "core/image/error_image.h"
#include "core/image/image_io.h"
#include "core/io/cut_layers.h"
#include "core/io/files.h"
#include "core/io/output_guard.h"
#include "core/io/pending_files.h"
#include "core/surface/mesh_io.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

using Clock = std::chrono::steady_clock;

/// What a cut writes beside its programs.
constexpr std::array kOthers{cam_file::kReport,        cam_file::kPage,    cam_file::kMilledMesh,
                             cam_file::kMilledPicture, cam_file::kLeakage, lens_file::kPartSurfaces,
                             lens_file::kCausePictures};

std::vector<const char*> others_of(const CamOptions& options) {
  if (options.render) return {kOthers.begin(), kOthers.end()};
  return {cam_file::kReport, cam_file::kPage};
}

/// What an earlier run predicted.
void remove_prediction(const fs::path& folder) {
  for (const char* name : kOthers) {
    std::error_code ignored;
    if (written_by_lensforge(folder / name)) fs::remove(folder / name, ignored);
  }
}

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
                            others_of(options_), options_.force);
    PendingPrograms programs(plan, options_.post, settings, folder_, control_);
    std::optional<Prediction> prediction;
    if (options_.render) prediction = predict(programs.programs());
    CamResult result;
    result.report = make_report(plan_, programs.programs(), prediction, lens_);
    const OtherPrograms others = other_programs(folder_, paths_of(programs.programs()));
    warn_of(others, result.report);
    result.report.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    PendingFiles files(folder_);
    if (prediction) add_pictures(*prediction, files);
    files.add(cam_file::kPage, report_html(result.report));
    // The job is called as its folder, whose name need not be UTF-8.
    constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
    files.add(cam_file::kReport, report_json(result.report).dump(1, ' ', false, kReplace) + "\n");
    publish(programs, others, files, result);
    result.message = result.report.verdict.passes()
                         ? "done, all limits met"
                         : "done, but limits were missed: see the report";
    return result;
  }

 private:
  Prediction predict(const ProgramFiles& programs) {
    const std::unique_ptr<MeantSurface> cut = meant_surface(plan_.optical());
    const auto rounded = cut->rounded(plan_.surface(), cut_rectangle(), executor_);
    // A mould's own surface is another than that of the lens that is cast in it.
    std::unique_ptr<MeantSurface> lens;
    if (plan_.mould()) {
      lens = meant_surface(optical_surface(lens_, plan_.model()));
    }
    const Eigen::AlignedBox2d rectangle(Eigen::Vector2d(0.0, 0.0), lens_.setup.lens_size);
    const PartSurfaces surfaces({lens ? lens->field() : cut->field(), *rounded, rectangle,
                                 plan_.blank().max().z(), plan_.mould()},
                                plan_.take_finish_paths(programs, control_),
                                options_.workshop.polish);
    Prediction prediction = predict_part(surfaces, lens_, options_, executor_, control_);
    if (options_.remedies) {
      try_remedies({plan_, lens_, surfaces.designed(), surfaces.part(), prediction.leakage},
                   prediction.places, executor_, control_);
    }
    if (options_.tolerances > 0) {
      prediction.tolerances = draw_parts(
          {plan_, lens_, surfaces, prediction.leakage.designed.picture}, executor_, control_);
    }
    return prediction;
  }

  [[nodiscard]] Eigen::AlignedBox2d cut_rectangle() const {
    const Eigen::AlignedBox3d& box = plan_.part_box();
    return {box.min().head<2>(), box.max().head<2>()};
  }

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

  void add_pictures(const Prediction& prediction, PendingFiles& files) const {
    const FluxPicture& part = prediction.leakage.part().picture;
    files.add(cam_file::kMilledMesh,
              [&](const fs::path& beside) { write_ply(prediction.milled, beside); });
    files.add(cam_file::kMilledPicture, [&](const fs::path& beside) {
      write_image(part.image(lens_.target.total()), beside);
    });
    files.add(cam_file::kLeakage, [&](const fs::path& beside) {
      write_image(leakage_picture(prediction.leakage), beside);
    });
    files.add(lens_file::kPartSurfaces,
              [&](const fs::path& beside) { write_layers(prediction.surfaces, beside); });
    files.add(lens_file::kCausePictures, [&](const fs::path& beside) {
      write_layers(cause_layers(prediction.leakage, lens_.target.total()), beside);
    });
  }

  static ColorImage leakage_picture(const LeakageResult& leakage) {
    const FluxPicture& part = leakage.part().picture;
    return false_color_image(surplus(part, leakage.designed.picture), part.columns, part.rows);
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
