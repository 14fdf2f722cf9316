// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/frame/option_set.h"
#include "app/view/lens_view.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/text/words.h"
#include "design/setup/design_options.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

/// Options of `lensforge view`.
struct ViewSettings {
  std::string source;
  std::string out;
  bool force = false;
  OtherLight light;
};

void describe(Description& d, ViewSettings& settings) {
  d.text("DIR", settings.source, "", "lens folder").needed = true;
  d.text("--out", settings.out, "FILE", "the page to write, .html").needed = true;
  d.flag("--force", settings.force, "replace a file that lensforge did not write");
  describe(d, settings.light);
}

void require_page_name(const std::string& out) {
  const std::string extension = lower_case(fs::path(out).extension().string());
  if (extension != ".html" && extension != ".htm") {
    throw InputError("--out " + out + ": must end in .html");
  }
}

nlohmann::json surfaces_json(const LensView& view) {
  nlohmann::json surfaces = nlohmann::json::object();
  for (const ViewedSurface& viewed : view.surfaces) {
    surfaces[viewed.id] = {{"vertices", viewed.surface.vertices},
                           {"triangles", viewed.surface.triangles},
                           {"storage_mae", viewed.storage_error},
                           {"exact", viewed.exact()}};
  }
  return surfaces;
}

std::string summary_text(const LensView& view, const std::string& out, std::uintmax_t bytes) {
  std::string text =
      printable_line(out) + ": " + fixed(static_cast<double>(bytes) * 1e-6, 1) + " MB\n";
  for (const ViewedSurface& viewed : view.surfaces) {
    text += "  " + viewed.words + ": " + std::to_string(viewed.surface.vertices) +
            " vertices, stored with an error of MAE " + fixed(viewed.storage_error, 6) + "\n";
  }
  return text;
}

/// Warnings of surfaces whose stored light is not the program's.
std::vector<std::string> warnings_of(const LensView& view) {
  std::vector<std::string> warnings;
  for (const ViewedSurface& viewed : view.surfaces) {
    if (viewed.exact()) continue;
    warnings.push_back("the surface " + viewed.words + " as stored in the page has MAE " +
                       fixed(viewed.storage_error, 4) + " from the program's picture, more than " +
                       fixed(kMaxStorageError, 3) +
                       "; the page shows the program's picture until a control is moved");
  }
  return warnings;
}

CommandResult run(CommandFrame& frame, ViewSettings& settings) {
  require_page_name(settings.out);
  require_replaceable("--out", settings.out, settings.force);
  frame.begin_file(settings.out);
  read_lamp(settings.light.light, {}, frame.control(), frame.console());
  const LensView view =
      read_view(settings.source, settings.light, frame.executor(), frame.control());
  for (const std::string& note : view.notes) frame.console().note(note);
  const std::string page = view_page(view);
  frame.begin_writing();
  write_whole_file(settings.out, page);
  std::vector<std::string> warnings = warnings_of(view);
  return {{{"source", settings.source},
           {"out", settings.out},
           {"bytes", page.size()},
           {"surfaces", surfaces_json(view)}},
          summary_text(view, settings.out, page.size()),
          exit_code(true, warnings.empty()),
          std::move(warnings)};
}

Command<ViewSettings> view_verb() {
  return {"view", "Writes a page that draws a lens's light and lets one change it.", run};
}

}  // namespace

int view_command(const Arguments& arguments) { return run_command(view_verb(), arguments); }

CommandCall view_call() { return call_of(view_verb(), ViewSettings()); }

}  // namespace lensforge::app
