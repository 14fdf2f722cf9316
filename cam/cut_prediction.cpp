// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/cut_prediction.h"

#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>

#include "cam/cam_job.h"
#include "cam/meant_surface.h"
#include "cam/part_layers.h"
#include "cam/part_surfaces.h"
#include "cam/remedies.h"
#include "cam/report/report_html.h"
#include "cam/report/report_json.h"
#include "cam/tolerance_run.h"
#include "core/image/error_image.h"
#include "core/image/image_io.h"
#include "core/io/cut_layers.h"
#include "core/io/output_guard.h"
#include "core/surface/mesh_io.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr std::array kOthers{cam_file::kReport,        cam_file::kPage,    cam_file::kMilledMesh,
                             cam_file::kMilledPicture, cam_file::kLeakage, lens_file::kPartSurfaces,
                             lens_file::kCausePictures};

Eigen::AlignedBox2d cut_rectangle(const CutPlan& plan) {
  const Eigen::AlignedBox3d& box = plan.part_box();
  return {box.min().head<2>(), box.max().head<2>()};
}

ColorImage leakage_picture(const LeakageResult& leakage) {
  const FluxPicture& part = leakage.part().picture;
  return false_color_image(surplus(part, leakage.designed.picture), part.columns, part.rows);
}

}  // namespace

Prediction predict_cut(CutPlan& plan, const Lens& lens, const ProgramFiles& programs,
                       const Executor& executor, const RunControl& control) {
  const CamOptions& options = plan.options();
  const std::unique_ptr<MeantSurface> cut = meant_surface(plan.optical());
  const auto rounded = cut->rounded(plan.surface(), cut_rectangle(plan), executor);
  // A mould's own surface is another than that of the lens that is cast in it.
  std::unique_ptr<MeantSurface> meant;
  if (plan.mould()) meant = meant_surface(optical_surface(lens, plan.model()));
  const Eigen::AlignedBox2d rectangle(Eigen::Vector2d(0.0, 0.0), lens.setup.lens_size);
  const PartSurfaces surfaces({meant ? meant->field() : cut->field(), *rounded, rectangle,
                               plan.blank().max().z(), plan.mould()},
                              plan.take_finish_paths(programs, control), options.workshop.polish);
  Prediction prediction = predict_part(surfaces, lens, options, executor, control);
  if (options.remedies) {
    try_remedies({plan, lens, surfaces.designed(), surfaces.part(), prediction.leakage},
                 prediction.places, executor, control);
  }
  if (options.tolerances > 0) {
    prediction.tolerances =
        draw_parts({plan, lens, surfaces, prediction.leakage.designed.picture}, executor, control);
  }
  return prediction;
}

std::vector<const char*> cut_file_names(const CamOptions& options) {
  if (options.render) return {kOthers.begin(), kOthers.end()};
  return {cam_file::kReport, cam_file::kPage};
}

void add_prediction_files(const Prediction& prediction, const Lens& lens, PendingFiles& files) {
  const FluxPicture& part = prediction.leakage.part().picture;
  files.add(cam_file::kMilledMesh,
            [&](const fs::path& beside) { write_ply(prediction.milled, beside); });
  files.add(cam_file::kMilledPicture,
            [&](const fs::path& beside) { write_image(part.image(lens.target.total()), beside); });
  files.add(cam_file::kLeakage, [&](const fs::path& beside) {
    write_image(leakage_picture(prediction.leakage), beside);
  });
  files.add(lens_file::kPartSurfaces,
            [&](const fs::path& beside) { write_layers(prediction.surfaces, beside); });
  files.add(lens_file::kCausePictures, [&](const fs::path& beside) {
    write_layers(cause_layers(prediction.leakage, lens.target.total()), beside);
  });
}

void add_report_files(const ReportData& report, PendingFiles& files) {
  files.add(cam_file::kPage, report_html(report));
  // The job is called as its folder, whose name need not be UTF-8.
  constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
  files.add(cam_file::kReport, report_json(report).dump(1, ' ', false, kReplace) + "\n");
}

void remove_prediction(const fs::path& folder) {
  for (const char* name : kOthers) {
    std::error_code ignored;
    if (written_by_lensforge(folder / name)) fs::remove(folder / name, ignored);
  }
}

}  // namespace lensforge
