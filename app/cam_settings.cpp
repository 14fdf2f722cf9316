// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/cam_settings.h"

#include "cam/plan/cam_options.h"

namespace lensforge::app {

namespace fs = std::filesystem;

std::string folder_name(const fs::path& folder) {
  const fs::path whole = fs::absolute(folder).lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

void add_cam_options(OptionSet& options, CamSettings& settings) {
  options.text("DIR", settings.source, "", "lens folder; --show-workshop needs none");
  options.text("--workshop", settings.workshop, "FILE.toml",
               "machine, blank, clamps, tools and process; options given here win");
  options.flag("--show-workshop", settings.show_workshop,
               "print the workshop in use as TOML and exit");
  options.texts(
      "--compare", settings.compare, "KEY=VALUE,…",
      "rank choices by leakage and hours instead of making programs: tool=0.3,0.4 "
      "pitch=0.04,0.06 slope=3e-5,6e-5 large=0,4 (finishing only); mae=0.004 recommends the "
      "quickest that reaches it");
  options.fields(cam_fields(), settings.cam);
}

void settle(OptionSet& options, CamSettings& settings) {
  const std::string file = settings.workshop.empty() ? "workshop" : settings.workshop;
  if (!settings.workshop.empty()) {
    settings.cam.workshop = read_workshop(settings.workshop);
    options.restate();
  }
  if (!settings.source.empty()) settings.cam.job = folder_name(settings.source);
  // A file's own values have been read and found in order: what is wrong now is an option's doing.
  validate(settings.cam.workshop, file + " with the options given");
}

}  // namespace lensforge::app
