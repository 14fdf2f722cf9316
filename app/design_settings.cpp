// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/design_settings.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <utility>

#include "app/json_output.h"
#include "cam/plan/cam_options.h"
#include "cam/workshop/workshop.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/svg_drawing.h"
#include "core/io/files.h"
#include "design/design_fields.h"
#include "design/front_setup.h"
#include "design/outline_setup.h"
#include "design/schedule/level_plan.h"
#include "design/source_setup.h"

namespace lensforge::app {

namespace {

/// The rows of `cam` that say what is milled.
const OptionTable<CamOptions>& part_fields() {
  static const OptionTable<CamOptions> fields = [] {
    OptionTable<CamOptions> rows;
    for (const auto& row : cam_fields()) {
      if (row.name == "--part" || row.name == "--shrinkage") rows.push_back(row);
    }
    return rows;
  }();
  return fields;
}

MadeBy process_of(const Workshop& shop, const DesignSettings& settings) {
  const FinishProcess& finish = shop.process.finish;
  const CamOptions& cut = settings.cut;
  const MadeBy made{finish_pitch(finish, shop.tool(finish.tool).radius()),
                    finish.along == PassAxis::kX,
                    shop.polish.sigma,
                    shop.polish.rim_depth,
                    shop.polish.rim_length,
                    settings.robust ? shop.tolerances.polish_sigma : 0.0};
  return cut.part == PartKind::kMould ? made.cast(cut.shrinkage) : made;
}

/// @throw InputError unless nothing is said of how a part is made.
void refuse_part_options(const OptionSet& options) {
  if (options.given("--robust")) {
    throw InputError("--robust: needs --made-by, which says how the part is made");
  }
  for (const auto& row : part_fields()) {
    if (options.given(row.name)) {
      throw InputError(row.name + ": needs --made-by, which says how the part is made");
    }
  }
}

void note_changes(DesignSettings& settings, const std::string& picture,
                  const std::vector<std::string>& changes) {
  for (const std::string& change : changes) settings.changes.push_back(picture + ": " + change);
}

/// A drawing has as many pixels as are asked for. @throw InputError naming a --pixels that would
/// do.
void require_wide_drawing(const Image& drawing, const DesignSettings& settings) {
  const int shorter = std::min(drawing.columns(), drawing.rows());
  if (shorter >= kMinPixels) return;
  // The shorter side was rounded, up by a half at most, and will be rounded again.
  const double least = (kMinPixels - 0.5) * settings.design.pixels / (shorter - 0.5);
  const bool possible = least <= kMaxImageSide;
  throw InputError(
      settings.target + ": is " + size_text(drawing.columns(), drawing.rows()) +
      " pixels with --pixels " + std::to_string(settings.design.pixels) +
      "; its shorter side needs at least " + std::to_string(kMinPixels) +
      (possible ? "; --pixels " + std::to_string(static_cast<int>(std::ceil(least))) + " would do"
                : ": draw it less narrow"));
}

}  // namespace

void add_design_options(OptionSet& options, DesignSettings& settings) {
  options.positional("TARGET", settings.target,
                     "picture to project: PNG, JPEG, TIFF, EXR, SVG, ...");
  options.required_text("--out", settings.out, "DIR", "lens folder to write");
  options.fields(design_fields(), settings.design);
  options.fields(light_fields(), settings.design.light);
  options.text("--source-picture", settings.source_picture, "FILE",
               "picture of the lamp as seen from the lens, as wide as --source-angle or "
               "--source-size; without it the lamp is an evenly lit disc");
  options.text(
      "--outline", settings.outline, "rectangle|circle|rounded:R|FILE",
      "edge of the lens: the largest circle, corners of radius R, or the shape that is white "
      "in a picture, seen from the cutter's side");
  options.fields(background_fields(), settings.background);
  options.fields(weight_fields(), settings.design.weights);
  options.text("--made-by", settings.made_by, "default|FILE.toml",
               "shape the part that this workshop cuts and polishes, not the surface alone");
  options.flag("--robust", settings.robust,
               "with --made-by: right on average over parts that are polished less and more by the "
               "workshop's tolerances.polish_sigma; takes twice as long");
  options.fields(part_fields(), settings.cut);
  options.text("--live", settings.live, "PORT",
               "serve a page that shows the design while it runs, to browsers on this machine; 0 "
               "takes a free port");
  options.flag("--resume", settings.resume,
               "continue the interrupted design in --out, with the same picture and options");
  options.flag("--force", settings.force, "replace the design that --out holds");
}

LoadedImage read_target(const DesignSettings& settings, const RunControl& control) {
  LoadedImage loaded =
      read_image(settings.target, control, settings.design.pixels, settings.background);
  if (control.stop_requested()) throw Interrupted();
  std::ifstream file = open_input(settings.target);
  if (is_svg(file)) require_wide_drawing(loaded.image, settings);
  return loaded;
}

void settle(OptionSet& options, DesignSettings& settings, const Image& picture,
            const RunControl& control) {
  const int longer = std::max(picture.columns(), picture.rows());
  if (longer < kMinPixels) {
    throw InputError(settings.target + ": has " + size_text(picture.columns(), picture.rows()) +
                     " pixels; its longer side needs at least " + std::to_string(kMinPixels));
  }
  if (!(picture.total() > 0.0)) {
    throw InputError(settings.target +
                     ": is black all over: there is no light to place; use a picture with some");
  }
  Workshop workshop;
  if (settings.made_by.empty()) {
    refuse_part_options(options);
    if (!options.given("--model")) {
      const int pixels = std::min(settings.design.pixels, longer);
      settings.design.model =
          default_model(working_size(picture.columns(), picture.rows(), pixels), settings.design);
    }
  } else {
    if (options.given("--model") && settings.design.model != SurfaceModel::kSpline) {
      throw InputError("--made-by " + settings.made_by + ": needs --model spline, not " +
                       model_name(settings.design.model));
    }
    settings.design.model = SurfaceModel::kSpline;
    if (settings.made_by != "default") workshop = read_workshop(settings.made_by);
  }
  settings.design = default_design_options(settings.design.model, picture);
  options.restate();
  if (!settings.source_picture.empty()) {
    const LoadedImage shape =
        read_image(settings.source_picture, control, kDrawnSide, settings.background);
    note_changes(settings, "--source-picture " + settings.source_picture, shape.changes);
    settings.design.light.source_shape = shape_of(shape.image);
  }
  LightOptions& light = settings.design.light;
  if (!light.front_file.empty()) light.front_heights = front_from(light.front_file, control);
  if (!settings.outline.empty()) {
    OutlineChoice choice = outline_from(settings.outline, settings.background, control);
    note_changes(settings, "--outline " + settings.outline, choice.changes);
    settings.design.outline = std::move(choice.outline);
  }
  if (!settings.made_by.empty()) settings.design.made_by = process_of(workshop, settings);
  validate(settings.design, picture);
}

}  // namespace lensforge::app
