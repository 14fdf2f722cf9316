// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/design_settings.h"

#include <algorithm>

#include "app/json_output.h"
#include "core/error.h"
#include "design/design_fields.h"

namespace lensforge::app {

void add_design_options(OptionSet& options, DesignSettings& settings) {
  options.positional("TARGET", settings.target, "picture to project: PNG, JPEG, TIFF, EXR, ...");
  options.required_text("--out", settings.out, "DIR", "lens folder to write");
  options.fields(design_fields(), settings.design);
  options.fields(weight_fields(), settings.design.weights);
  options.flag("--resume", settings.resume,
               "continue the interrupted design in --out, with the same picture and options");
  options.flag("--force", settings.force, "replace the design that --out holds");
}

void settle(OptionSet& options, DesignSettings& settings, const Image& picture) {
  const int longer = std::max(picture.columns(), picture.rows());
  if (longer < kMinPixels) {
    throw InputError(settings.target + ": has " + size_text(picture.columns(), picture.rows()) +
                     " pixels; its longer side needs at least " + std::to_string(kMinPixels));
  }
  settings.design = default_design_options(settings.design.model, picture);
  options.restate();
  validate(settings.design, picture);
}

}  // namespace lensforge::app
