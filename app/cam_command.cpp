// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>

#include "app/commands.h"
#include "app/console.h"
#include "app/exit_code.h"
#include "app/interrupt.h"
#include "app/json_output.h"
#include "app/option_set.h"
#include "app/output_folder.h"
#include "app/progress_display.h"
#include "cam/cam_job.h"
#include "core/error.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

void add_tool_options(OptionSet& options, CamOptions& cam) {
  options.length("--tool-diameter", cam.tool_diameter, Limits::above(0), "ball-end mill");
  options.length("--pitch", cam.pitch, Limits::above(0), "stepover between rows at most");
  options.number("--spindle", cam.spindle_rpm, Limits::above(0), "rpm", "spindle speed");
  options.number("--spin-up", cam.spin_up, Limits::at_least(0), "s", "wait after spindle start");
  options.number("--feed", cam.feed, Limits::above(0), "mm/min", "cutting feed");
  options.number("--plunge", cam.plunge, Limits::above(0), "mm/min", "feed straight down");
}

void add_blank_options(OptionSet& options, CamOptions& cam) {
  options.length("--stock", cam.stock, Limits::at_least(0),
                 "top of the blank above the surface's highest point");
  options.length("--safe-height", cam.safe_height, Limits::above(0),
                 "height of rapid moves above the top of the blank");
  options.choice("--z-zero", cam.z_zero,
                 {{"stock", ZZero::kStock}, {"table", ZZero::kTable}, {"lens", ZZero::kLens}},
                 "Z0: top of the blank, the table below it, or the lens's highest point");
}

void add_program_options(OptionSet& options, CamOptions& cam) {
  options.length("--tolerance", cam.tolerance, Limits::above(0),
                 "farthest that the path runs from the exact one");
  options.number("--slope-tolerance", cam.slope_tolerance, Limits::above(0), "rad",
                 "farthest that a move's direction is from the exact one");
  options.integer("--decimals", cam.decimals, Limits::between(4, 6), "digits after the point");
  options.choice("--post", cam.post, {{"linuxcnc", Post::kLinuxcnc}, {"grbl", Post::kGrbl}},
                 "dialect of the controller");
}

std::string folder_name(const fs::path& folder) {
  const fs::path whole = fs::absolute(folder).lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

std::string summary_text(const fs::path& folder, const CamResult& result) {
  const Eigen::Vector3d size = result.tip.sizes();
  return folder.string() + ": " + result.message + "\n" +                                //
         "  program      " + std::to_string(result.lines) + " lines, " +                 //
         std::to_string(result.rows) + " rows at " + fixed(result.pitch, 4) + " mm\n" +  //
         "  tool tip     " + fixed(size.x(), 2) + " x " + fixed(size.y(), 2) + " x " +
         fixed(size.z(), 3) + " mm, " + fixed(result.deepest_cut, 3) + " mm into the blank\n" +
         "  length       " + fixed(result.cutting_length / 1000.0, 1) + " m, " +
         fixed(result.length_over_feed_min, 1) +
         " min at the feed; acceleration makes it longer\n" +
         "  Z            program Z = lens z + " + fixed(result.z_offset, 4) + " mm\n";
}

nlohmann::json summary_json(const OptionSet& options, const CamOptions& cam,
                            const CamResult& result) {
  nlohmann::json json = {
      {"command", "cam"},          {"status", result.done() ? "done" : "interrupted"},
      {"message", result.message}, {"warnings", result.warnings},
      {"options", options.used()}, {"files", nlohmann::json::array()}};
  for (const fs::path& file : result.files) json["files"].push_back(file.string());
  if (result.done()) json["report"] = cam_report(cam, result);
  return json;
}

CamResult run(const OptionSet& options, const CamOptions& cam, const Lens& lens,
              const fs::path& out) {
  const InterruptWatch interrupt;
  const OutputFolder folder(out);
  folder.remove_partial_files();
  ProgressDisplay progress(options.common().quiet);
  const RunControl control(interrupt.token(), progress.sink());
  return make_finish_program(lens, cam, out, options.executor(), control);
}

}  // namespace

int cam_command(const Arguments& command_line) {
  std::string source;
  CamOptions cam;
  OptionSet options("cam", "Makes the finishing program of a lens: DIR/cam/finish.ngc and report.");
  options.positional("DIR", source, "lens folder");
  add_tool_options(options, cam);
  add_blank_options(options, cam);
  add_program_options(options, cam);
  options.parse(command_line);
  const Console console(options.common().json, options.common().quiet);
  const Lens lens = read_lens(source);
  cam.job = folder_name(source);
  validate(cam, lens.setup);
  const fs::path out = fs::path(source) / "cam";
  const CamResult result = run(options, cam, lens, out);
  if (result.status == CamResult::Status::kFailed) throw RunError(result.message);
  for (const std::string& warning : result.warnings) console.note("warning: " + warning);
  console.result(summary_json(options, cam, result),
                 result.done() ? summary_text(out, result) : result.message + "\n");
  return result.done() ? kDone : kInterrupted;
}

}  // namespace lensforge::app
