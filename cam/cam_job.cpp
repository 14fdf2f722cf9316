// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/cam_job.h"

#include <chrono>
#include <limits>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "cam/contact/drop_cutter.h"
#include "cam/cut_plan.h"
#include "cam/cut_report.h"
#include "cam/finish_setup.h"
#include "cam/milled/designed_field.h"
#include "cam/milled/held_field.h"
#include "cam/part_surfaces.h"
#include "cam/prediction.h"
#include "cam/remedies.h"
#include "cam/report/report_html.h"
#include "cam/report/report_json.h"
#include "core/error.h"
#include "core/error_image.h"
#include "core/files.h"
#include "core/image_io.h"
#include "core/mesh_io.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

using Clock = std::chrono::steady_clock;

/// How finely the smooth surface is cut into facets where the ball's reach is judged: only heights
/// count, since a fillet's slopes are the ball's.
constexpr SmoothCutOptions kReachCut{1e-4, std::numeric_limits<double>::infinity()};

/// A surface as it is meant: the facets of a mesh, or the smooth surface through its vertices.
class MeantSurface {
 public:
  /// @param smooth  smooth_surface() of the mesh.
  MeantSurface(const SurfaceMesh& mesh, std::shared_ptr<const SmoothSurface> smooth)
      : smooth_(std::move(smooth)) {
    if (smooth_) {
      field_.emplace(*smooth_);
      held_.emplace(*field_);
    } else {
      facets_.emplace(mesh);
      held_.emplace(*facets_);
    }
  }

  [[nodiscard]] const SurfaceField& field() const { return *held_; }

  /// What the ball can reach of it. `cut` is the same surface; both must outlive the result.
  [[nodiscard]] std::unique_ptr<RoundedField> rounded(const CutSurface& cut,
                                                      const Eigen::AlignedBox2d& rectangle,
                                                      const Executor& executor) {
    if (smooth_) {
      reach_.emplace(smooth_, cut.radius(), kReachCut, executor);
      return std::make_unique<RoundedField>(*held_, *reach_, reach_->deviation().height, executor);
    }
    cutter_ = cut.cutter(rectangle, executor);
    return std::make_unique<RoundedField>(*held_, facets_->grid(), *cutter_, executor);
  }

 private:
  std::optional<FacetField> facets_;
  std::shared_ptr<const SmoothSurface> smooth_;
  std::optional<SmoothCutSurface> reach_;
  std::optional<SmoothField> field_;
  std::optional<HeldField> held_;
  std::shared_ptr<const DropCutter> cutter_;
};

void remove_foretold(const fs::path& folder) {
  for (const char* file : {cam_file::kReport, cam_file::kPage, cam_file::kMilledMesh,
                           cam_file::kMilledPicture, cam_file::kLeakage}) {
    std::error_code ignored;
    fs::remove(folder / file, ignored);
  }
}

/// finish.ngc, finish_2.nc, finish-cross.ngc
bool is_program(const fs::path& file) {
  const std::string stem = file.stem().string();
  for (const std::string name : {"rough", "semi", "finish", "cross", "pencil"}) {
    if (!stem.starts_with(name)) continue;
    if (stem.size() == name.size() || stem[name.size()] == '_' || stem[name.size()] == '-') {
      return true;
    }
  }
  return false;
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
    const ProgramFiles programs = write_programs(plan_.programs(control_), options_.post,
                                                 plan_.settings(), folder_, control_);
    remove_foretold(folder_);
    CamResult result;
    for (const ProgramFile& file : programs.files) result.files.push_back(file.path);
    std::optional<Prediction> prediction;
    if (options_.render) prediction = predict(programs);
    result.report = make_report(plan_, programs, prediction, lens_);
    result.report.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    if (prediction) write_pictures(*prediction, result);
    write_report(result);
    result.message = result.report.verdict.passes()
                         ? "done, all limits met"
                         : "done, but limits are not met: see the report";
    return result;
  }

 private:
  Prediction predict(const ProgramFiles& programs) {
    MeantSurface cut(plan_.mesh(), plan_.smooth());
    const auto rounded = cut.rounded(plan_.surface(), cut_rectangle(), executor_);
    // A mould's own surface is another than that of the lens that is cast in it.
    std::optional<MeantSurface> lens;
    if (plan_.mould()) {
      lens.emplace(lens_.surface, smooth_surface(lens_.surface, options_.surface));
    }
    const Eigen::AlignedBox2d rectangle(Eigen::Vector2d(0.0, 0.0), lens_.setup.lens_size);
    const PartSurfaces surfaces({lens ? lens->field() : cut.field(), *rounded, rectangle,
                                 plan_.blank().max().z(), plan_.mould()},
                                plan_.take_finish_paths(programs, control_), options_.polish);
    Prediction prediction = predict_part(surfaces, lens_, options_, executor_, control_);
    if (options_.remedies) {
      try_remedies({plan_, lens_, surfaces.designed(), surfaces.part(), prediction.leakage},
                   prediction.places, executor_, control_);
    }
    return prediction;
  }

  [[nodiscard]] Eigen::AlignedBox2d cut_rectangle() const {
    const Eigen::AlignedBox3d& box = plan_.part_box();
    return {box.min().head<2>(), box.max().head<2>()};
  }

  void write_pictures(const Prediction& prediction, CamResult& result) const {
    const auto add = [&](const char* name) { return result.files.emplace_back(folder_ / name); };
    const FluxPicture& part = prediction.leakage.part().picture;
    write_ply(prediction.milled, add(cam_file::kMilledMesh));
    write_image(part.image(lens_.target.total()), add(cam_file::kMilledPicture));
    write_image(leakage_picture(prediction.leakage), add(cam_file::kLeakage));
  }

  static ColorImage leakage_picture(const LeakageResult& leakage) {
    const FluxPicture& part = leakage.part().picture;
    return false_color_image(surplus(part, leakage.designed.picture), part.columns, part.rows);
  }

  void write_report(CamResult& result) const {
    result.files.push_back(folder_ / cam_file::kPage);
    write_whole_file(result.files.back(), report_html(result.report));
    result.files.push_back(folder_ / cam_file::kReport);
    write_whole_file(result.files.back(), report_json(result.report).dump(1) + "\n");
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
  remove_foretold(folder);
  std::error_code ignored;
  std::vector<fs::path> programs;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (is_program(entry.path())) programs.push_back(entry.path());
  }
  for (const fs::path& program : programs) fs::remove(program, ignored);
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
