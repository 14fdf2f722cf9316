// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/cam_settings.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "cam/post/program_writer.h"
#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

constexpr double kMegabyte = 1e6;

std::string folder_name(const fs::path& folder) {
  const fs::path whole = fs::absolute(folder).lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

/// The range of one of the workshop's numbers (workshop_rule()).
Limits as_in_workshop(const char* key) {
  const NumberRule rule = workshop_rule(key);
  return Limits::between(rule.least, rule.most);
}

Tool& tool_of(Workshop& workshop, int number) {
  for (Tool& tool : workshop.tools) {
    if (tool.number == number) return tool;
  }
  throw InputError("--workshop: there is no tool " + std::to_string(number));
}

void add_tool_options(OptionSet& options, CamSettings& s) {
  Tool& ball = s.finish_tool;
  FinishProcess& finish = s.process.finish;
  options.length("--tool-diameter", ball.diameter, as_in_workshop("tool.diameter"),
                 "finishing ball-end mill");
  options.length("--pitch", finish.pitch, as_in_workshop("finish.pitch"),
                 "stepover between rows at most");
  options.length("--scallop", finish.scallop, as_in_workshop("finish.scallop"),
                 "height of scallops; if above 0, the pitch follows from it");
  options.number("--spindle", ball.spindle_rpm, as_in_workshop("tool.spindle_rpm"), "rpm",
                 "finishing speed");
  options.number("--feed", ball.feed, as_in_workshop("tool.feed"), "mm/min", "finishing feed");
  options.number("--plunge", ball.plunge, as_in_workshop("tool.plunge"), "mm/min",
                 "feed straight down");
  options.length("--rough-tool", s.rough_tool, as_in_workshop("tool.diameter"),
                 "diameter of the roughing tool");
  options.text("--workshop", s.workshop, "FILE.toml",
               "machine, blank, clamps, tools and process; options given here win");
  options.flag("--force", s.cam.force,
               "replace files in DIR/cam that lensforge did not write as they stand");
  options.flag("--show-workshop", s.show_workshop,
               "print the workshop as it would be used as TOML, and end");
}

void add_raster_options(OptionSet& options, CamSettings& s) {
  FinishProcess& finish = s.process.finish;
  options.choice("--along", finish.along, {{"x", PassAxis::kX}, {"y", PassAxis::kY}},
                 "axis along which finishing rows run");
  options.choice("--order", finish.style,
                 {{"zigzag", PassStyle::kZigzag},
                  {"climb", PassStyle::kClimb},
                  {"conventional", PassStyle::kConventional}},
                 "finishing rows to and fro, or all one way");
  options.flag("--cross", finish.cross, "finish a second time, along the other axis");
  options.flag("--pencil", finish.pencil, "a last pass along the creases");
  options.length("--tolerance", finish.tolerance, as_in_workshop("finish.tolerance"),
                 "farthest that the path runs from the exact one");
  options.number("--slope-tolerance", finish.slope_tolerance,
                 as_in_workshop("finish.slope_tolerance"), "rad",
                 "farthest that a move's direction is from the exact one");
  options.integer("--decimals", s.cam.decimals, Limits::between(0, 6),
                  "digits after the point, 4 to 6; 0: as the tolerances ask");
  options.flag("--no-arcs", s.no_arcs, "straight finishing moves only");
  options.flag("--no-rough", s.no_rough, "no roughing program");
  options.flag("--no-semi", s.no_semi, "no semi-finishing program");
}

void add_blank_options(OptionSet& options, CamSettings& s) {
  options.length("--stock", s.stock.allowance, as_in_workshop("stock.allowance"),
                 "top of the blank above the surface's highest point");
  options.length("--margin", s.stock.margin, as_in_workshop("stock.margin"),
                 "blank beyond the lens on every side");
  options.length("--safe-height", s.process.safe_height, as_in_workshop("process.safe_height"),
                 "height of rapid moves above the top of the blank");
  options.choice("--z-zero", s.cam.z_zero,
                 {{"stock", ZZero::kStock}, {"table", ZZero::kTable}, {"lens", ZZero::kLens}},
                 "Z0: top of the blank, the table below it, or the lens's highest point");
  options.choice("--part", s.cam.part, {{"lens", PartKind::kLens}, {"mould", PartKind::kMould}},
                 "mill the lens, or the mould to cast it in");
  options.number("--shrinkage", s.cam.shrinkage, Limits::between(0, cam_limit::kShrinkage), "",
                 "of what is cast in the mould, share of a length");
  options.choice("--surface", s.surface,
                 {{"designed", std::nullopt},
                  {"smooth", SurfaceModel::kSmooth},
                  {"facet", SurfaceModel::kFacet}},
                 "cut what was designed, the smooth surface over the mesh, or its facets");
}

void add_program_options(OptionSet& options, CamSettings& s) {
  options.text("--post", s.post, "NAME|FILE.toml",
               "dialect: linuxcnc, grbl, fanuc, or a description of one");
  options.choice("--programs", s.cam.grouping,
                 {{"operation", ProgramGrouping::kOperation},
                  {"tool", ProgramGrouping::kTool},
                  {"one", ProgramGrouping::kAll}},
                 "a file per operation, per tool, or one where the dialect changes tools");
  options.number("--split", s.split_mb, Limits::between(0, 1e5), "MB",
                 "split programs above this size; 0: as the dialect needs");
  options.number("--spin-up", s.cam.spin_up, Limits::between(0, cam_limit::kSpinUp), "s",
                 "wait after spindle start");
  options.choice("--coolant", s.cam.coolant,
                 {{"off", Coolant::kOff}, {"mist", Coolant::kMist}, {"flood", Coolant::kFlood}},
                 "coolant");
}

void add_limit_options(OptionSet& options, CutLimits& limits) {
  options.number("--max-leakage", limits.leakage, Limits::between(0, cam_limit::kLimit), "",
                 "verdict: share of light that may land where the design puts less");
  options.number("--max-dark", limits.dark_flux, Limits::between(0, cam_limit::kLimit), "",
                 "verdict: share of light that may land in dark parts");
  options.number("--max-mae-increase", limits.mae_increase, Limits::between(0, cam_limit::kLimit),
                 "", "verdict: MAE of the part above that of the design");
  options.length("--max-gouge", limits.gouge, Limits::between(0, cam_limit::kLimit),
                 "verdict: deepest cut below the exact path");
  options.length("--max-excess", limits.excess, Limits::between(0, cam_limit::kLimit),
                 "verdict: highest path above the exact one");
  options.number("--max-slope", limits.slope, Limits::between(0, cam_limit::kLimit), "rad",
                 "verdict: error of the path's direction over 5 µm");
  options.length("--max-fillet", limits.fillet_depth, Limits::between(0, cam_limit::kLimit),
                 "verdict: material that the ball leaves in creases");
}

void add_prediction_options(OptionSet& options, CamSettings& s) {
  options.texts("--compare", s.compare, "KEY=MM,…",
                "rank choices by leakage and hours instead of making programs: tool=0.3,0.4 "
                "pitch=0.04,0.06 (finishing only)");
  options.flag("--no-render", s.no_render, "programs only, without what the part will project");
  options.length("--polish-sigma", s.cam.polish.sigma, Limits::between(0, cam_limit::kPolish),
                 "polishing averages heights with a Gaussian of this σ");
  options.length("--rim-depth", s.cam.polish.rim_depth, Limits::between(0, cam_limit::kPolish),
                 "polishing takes this much more off at the rim");
  options.length("--rim-length", s.cam.polish.rim_length,
                 Limits::between(cam_limit::kLeastRim, cam_limit::kRim),
                 "distance over which that falls to a third");
  options.length("--sample-spacing", s.cam.sample_spacing, Limits::between(0, 1.0),
                 "of the milled surface that is rendered; 0: as pitch and σ ask");
  options.number("--dark-below", s.cam.leakage.dark_below, Limits::between(0, cam_limit::kDark), "",
                 "parts of the picture below this share of its mean are dark");
  add_limit_options(options, s.cam.limits);
}

/// Bytes of a program at most; 0 for no limit.
[[nodiscard]] std::uintmax_t largest_file(double megabytes) {
  constexpr double kLeast = static_cast<double>(kSmallestProgramLimit) / kMegabyte;
  if (megabytes > 0.0 && megabytes < kLeast) {
    throw InputError("--split " + shortest_text(megabytes) + ": must be 0 or at least " +
                     shortest_text(kLeast) + " MB, which a program's head, end and one arc take");
  }
  return static_cast<std::uintmax_t>(std::llround(megabytes * kMegabyte));
}

/// Puts what was given over the workshop.
void overrule(const OptionSet& options, const CamSettings& s, Workshop& workshop) {
  Process& process = workshop.process;
  Tool& ball = tool_of(workshop, process.finish.tool);
  const auto take = [&](const char* name, auto& to, const auto& from) {
    if (options.given(name)) to = from;
  };
  if (options.given("--tool-diameter")) ball = resized(ball, s.finish_tool.diameter);
  if (options.given("--rough-tool")) {
    Tool& rough = tool_of(workshop, process.rough.tool);
    rough = resized(rough, s.rough_tool);
  }
  take("--spindle", ball.spindle_rpm, s.finish_tool.spindle_rpm);
  take("--feed", ball.feed, s.finish_tool.feed);
  take("--plunge", ball.plunge, s.finish_tool.plunge);
  take("--pitch", process.finish.pitch, s.process.finish.pitch);
  take("--scallop", process.finish.scallop, s.process.finish.scallop);
  take("--along", process.finish.along, s.process.finish.along);
  take("--order", process.finish.style, s.process.finish.style);
  take("--cross", process.finish.cross, s.process.finish.cross);
  take("--pencil", process.finish.pencil, s.process.finish.pencil);
  take("--tolerance", process.finish.tolerance, s.process.finish.tolerance);
  take("--slope-tolerance", process.finish.slope_tolerance, s.process.finish.slope_tolerance);
  take("--safe-height", process.safe_height, s.process.safe_height);
  take("--stock", workshop.stock.allowance, s.stock.allowance);
  take("--margin", workshop.stock.margin, s.stock.margin);
  if (s.no_rough) process.rough.enabled = false;
  if (s.no_semi) process.semi.enabled = false;
}

}  // namespace

void add_cam_options(OptionSet& options, CamSettings& settings) {
  const Workshop defaults;
  settings.process = defaults.process;
  settings.stock = defaults.stock;
  settings.finish_tool = defaults.tool(defaults.process.finish.tool);
  settings.rough_tool = defaults.tool(defaults.process.rough.tool).diameter;
  settings.post = settings.cam.post.name;
  options.positional("DIR", settings.source, "lens folder");
  add_tool_options(options, settings);
  add_raster_options(options, settings);
  add_blank_options(options, settings);
  add_program_options(options, settings);
  add_prediction_options(options, settings);
}

CamOptions cam_options(const OptionSet& options, const CamSettings& settings) {
  CamOptions cam = settings.cam;
  const std::string file = settings.workshop.empty() ? "workshop" : settings.workshop;
  if (!settings.workshop.empty()) cam.workshop = read_workshop(settings.workshop);
  overrule(options, settings, cam.workshop);
  cam.post = find_post(settings.post, "--post");
  cam.largest_file = largest_file(settings.split_mb);
  cam.arcs = !settings.no_arcs;
  cam.render = !settings.no_render;
  cam.job = folder_name(settings.source);
  validate(cam.workshop, file);
  return cam;
}

}  // namespace lensforge::app
