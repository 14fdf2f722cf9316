// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/design_output.h"

#include <system_error>
#include <utility>

#include "app/json_output.h"
#include "app/overview.h"
#include "cam/cam.h"
#include "core/image/image_io.h"
#include "core/io/checkpoint_file.h"
#include "core/io/lens_folder.h"
#include "core/io/pending_files.h"
#include "core/page/light_drawing.h"
#include "core/text/version.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

/// The process that a design is for and what comes out of it.
nlohmann::json made_json(const MadeBy& process, const DesignResult::Made& made) {
  return {{"pitch_mm", process.pitch},
          {"along", process.rows_along_x ? "x" : "y"},
          {"polish_sigma_mm", process.polish_sigma},
          {"rim_depth_mm", process.rim_depth},
          {"rim_length_mm", process.rim_length},
          {"polish_spread", process.polish_spread},
          {"metrics", metrics_json(made.metrics)}};
}

}  // namespace

nlohmann::json source_json(const SourceCheck& source) {
  return {{"blur_pixels", source.blur},
          {"points", source.points},
          {"halving_mae", source.halving},
          {"convolution_mae", source.convolution}};
}

nlohmann::json fringe_json(const Fringe& fringe) {
  return {{"mean", fringe.mean}, {"max", fringe.max}};
}

nlohmann::json design_provenance(const OptionSet& options, const ChosenDevice& device,
                                 const DesignOptions& design, const DesignResult& result) {
  const bool done = result.status == DesignResult::Status::kDone;
  nlohmann::json fields = {
      {"program", program_mark()},
      {"options", options.used()},
      {"seconds", result.convergence.empty() ? 0.0 : result.convergence.back().seconds},
      {"device", device.word},
      {"threads", device.executor.concurrency()},
      {"status", done ? "done" : "interrupted"},
      {"message", result.message},
      {"fingerprint", fingerprint_text(result.fingerprint)}};
  if (result.source) fields["source_check"] = source_json(*result.source);
  if (result.colors) fields["fringe_mm"] = fringe_json(result.colors->fringe);
  if (result.made) fields["made_by"] = made_json(*design.made_by, *result.made);
  return fields;
}

void write_design(const fs::path& folder, const DesignResult& result, const Console& console) {
  PendingFiles files(folder);
  files.add(lens_file::kConvergence, convergence_csv(result.convergence));
  const Image* const made = result.made ? &result.made->picture : nullptr;
  files.add(lens_file::kOverview,
            [&](const fs::path& beside) { write_image(draw_overview(result.lens, made), beside); });
  files.add(lens_file::kSetup,
            light_drawing_file(result.lens.setup, result.lens.surface.vertices.row(2).maxCoeff()));
  if (result.colors) {
    files.add(lens_file::kRenderColor,
              [&](const fs::path& beside) { write_image(result.colors->picture, beside); });
  }
  write_lens(result.lens, std::move(files));
  std::error_code ignored;
  if (!result.colors) fs::remove(folder / lens_file::kRenderColor, ignored);
  const fs::path cut = folder / lens_file::kCut;
  if (!fs::is_directory(cut, ignored)) return;
  remove_cut(cut);
  if (!fs::remove(cut, ignored)) {
    console.note(cut.string() + ": holds files that lensforge did not write; they are kept");
  }
}

}  // namespace lensforge::app
