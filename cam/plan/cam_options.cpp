// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/plan/cam_options.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "cam/milled/mould.h"
#include "cam/path/finish_raster.h"
#include "cam/path/rough.h"
#include "cam/plan/finishing.h"
#include "cam/post/program_writer.h"
#include "core/error.h"
#include "core/image/color.h"
#include "core/lens/optical_surface.h"
#include "core/optics/front.h"
#include "core/optics/polish_transfer.h"
#include "core/schema/description.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

/// Samples per finishing row. Not a whole number: samples that hit every row at the same places all
/// err alike, by 4.5 % of the leakage at a pitch of 0.07 mm.
constexpr double kSamplesPerRow = 6.1;

/// The same where a polish's floor keeps a share of the scallops' slopes: a part on 5 mm with order
/// 4 and 3 % leaks 0.49 % with 6.1, 0.24 % with 12.2 and 0.16 % with 24.4.
constexpr double kSamplesPerFloor = 24.4;

/// Maximum ratio of the sample spacing along the passes to that across them.
constexpr double kAlongPasses = 3.0;

/// The same limit as a share of the mean area of lens that lights a pixel: with 0.15 the design of
/// a 128² portrait has a predicted MAE of 0.0020 instead of 0.0018.
constexpr double kAlongPixel = 0.1;

/// Rendering the unpolished surface is slow because its light spreads widely. Along the passes its
/// samples are 3 times as far apart; the MAE of a 256² portrait changes from 0.0947 to 0.0949.
constexpr double kAlongScallops = 3.0;
constexpr double kScallopPixel = 0.25;

[[noreturn]] void refuse(const char* option, double value, const std::string& rule) {
  throw InputError(std::string(option) + " " + shortest_text(value) + ": " + rule);
}

/// Rounding takes a quarter of a tolerance.
void validate_decimals(const CamOptions& options) {
  if (options.decimals > options.post.most_decimals) {
    refuse("--decimals", options.decimals,
           "the post takes at most " + std::to_string(options.post.most_decimals));
  }
  const double tolerance = options.workshop.process.finish.tolerance;
  const double finest = 4.0 * resolution_of(options);
  if (!(tolerance >= finest * (1.0 - 1e-12))) {
    refuse("--tolerance", tolerance,
           "must be at least 4 units of the last decimal, " + shortest_text(finest) + " mm");
  }
}

void validate_sampling(const CamOptions& options) {
  if (options.workshop.polish.sigma > 0.0 &&
      options.sample_spacing > options.workshop.polish.sigma) {
    refuse("--sample-spacing", options.sample_spacing,
           "must be at most --polish-sigma, " + shortest_text(options.workshop.polish.sigma) +
               " mm, which it could not show");
  }
}

void validate_tolerances(const CamOptions& options, const OpticalSetup& setup) {
  if (options.tolerances == 0) return;
  if (!options.render) {
    refuse("--tolerances", options.tolerances,
           "needs the predicted picture: leave out --no-render, or use --tolerances 0");
  }
  const std::string fault = tolerance_fault(options, setup);
  if (!fault.empty()) {
    refuse("--tolerances", options.tolerances, fault + "; use --tolerances 0");
  }
}

void validate_outline(const CamOptions& options) {
  if (options.cut_outline == OutlineWish::kAlways && options.part == PartKind::kMould) {
    throw InputError("--cut-outline always: a mould keeps its blank; use --cut-outline never");
  }
  if (options.outline_tool > 0 && options.workshop.find_tool(options.outline_tool) == nullptr) {
    refuse("--outline-tool", options.outline_tool,
           "the workshop has no tool of this number; 0 takes the roughing tool");
  }
}

/// A lens with a spectrum is lit by it.
void validate_wavelength(const CamOptions& options, const OpticalSetup& setup) {
  if (setup.spectrum.none() || options.wavelength_nm == CamOptions().wavelength_nm) return;
  refuse("--wavelength", options.wavelength_nm,
         "the lens has wavelengths of its own, which are used; leave it out");
}

/// On a smaller blank the rim would fall off, and polish would take that for the surface.
void validate_margin(const CamOptions& options) {
  const double margin = options.workshop.stock.margin;
  const double needed = apron_to_cut(options);
  if (margin >= needed) return;
  const bool film = options.workshop.polish.order == kFilmOrder;
  refuse(
      "stock.margin", margin,
      "is too small for what is cut around the lens so that its rim comes out like the rest, the "
      "finishing ball's radius and " +
          std::string(film ? "16" : "8") + " σ of the polish; " +
          decimal_text(std::ceil(100.0 * needed) / 100.0, 2) + " mm works");
}

const HeightFront* height_map_of(const OpticalSetup& setup) {
  return setup.front ? std::get_if<HeightFront>(&*setup.front) : nullptr;
}

/// Width that the frame of a front has to have, mm.
double frame_needed(const Process& process, const Workshop& workshop) {
  double widest = kMinFrame;
  if (process.rough.enabled) widest = std::max(widest, workshop.tool(process.rough.tool).radius());
  if (process.semi.enabled) widest = std::max(widest, workshop.tool(process.semi.tool).radius());
  return widest;
}

/// What stock.margin lacks for a frame, and one that works; empty if there is a frame.
std::string frame_fault(const CamOptions& options, const OpticalSetup& setup) {
  const double width = frame_width(options, setup);
  const double needed = frame_needed(options.workshop.process, options.workshop);
  if (width >= needed) return "";
  const double margin = options.workshop.stock.margin;
  return joined({"stock.margin ", shortest_text(margin), " mm leaves no flat frame ",
                 shortest_text(needed), " mm wide around the front for the blank to lie on"});
}

/// A margin that leaves a frame, as an option.
std::string margin_option(const CamOptions& options, const OpticalSetup& setup) {
  return joined({"--margin ", decimal_text(margin_for_frame(options, setup), 1), "mm"});
}

/// The greatest slope of a height map at its samples and half-way between them, and its place.
std::pair<double, Eigen::Vector2d> steepest_of(const HeightFront& front) {
  const FrontSurface surface(front);
  const HeightGrid& grid = front.spline->grid();
  const Eigen::Vector2d half =
      0.5 * front.size.cwiseQuotient(Eigen::Vector2d(grid.columns - 1, grid.rows - 1));
  std::pair<double, Eigen::Vector2d> steepest{0.0, {0.0, 0.0}};
  for (int j = 0; j < 2 * grid.rows - 1; ++j) {
    for (int i = 0; i < 2 * grid.columns - 1; ++i) {
      const Eigen::Vector2d at = front.corner + half.cwiseProduct(Eigen::Vector2d(i, j));
      const double slope = surface.at(at).gradient.norm();
      if (slope > steepest.first) steepest = {slope, at};
    }
  }
  return steepest;
}

/// The options of a front's cut; the blank has to stay whole for its back.
void validate_face(const CamOptions& options, const OpticalSetup& setup) {
  if (options.face == CutFace::kBack) return;
  const HeightFront* const front = height_map_of(setup);
  if (options.part != PartKind::kLens) {
    throw InputError("--face front: a mould is cut from one side; leave it out");
  }
  if (front == nullptr) {
    throw InputError(joined({"--face front: the lens's front is ",
                             setup.front ? "a sphere, which its blank is bought or ground with"
                                         : "flat, as the blank's",
                             "; only one of --faces two, --second or --front FILE is cut"}));
  }
  if (options.surface && *options.surface != SurfaceModel::kSpline) {
    throw InputError(joined({"--surface ", model_name(*options.surface),
                             ": a front is cut as the spline that it is; leave it out"}));
  }
  if (options.z_zero == ZZero::kTable) {
    throw InputError(
        "--z-zero table: the front's heights count from the top of the blank, which it lies on "
        "afterwards; use stock or lens");
  }
  if (options.cut_outline == OutlineWish::kAlways) {
    throw InputError(
        "--cut-outline always: the blank has to stay whole until its back is cut; leave it out");
  }
  if (options.light == LightModel::kWaves) {
    throw InputError("--light-model waves: a front is judged by rays; use auto or rays");
  }
  const auto [slope, place] = steepest_of(*front);
  if (slope > kSteepestSlope) {
    throw InputError(joined({"--face front: the front rises by ", decimal_text(slope, 2),
                             " mm a millimetre at x ", decimal_text(place.x(), 2), " y ",
                             decimal_text(place.y(), 2), ", too steep for the ball: at most ",
                             shortest_text(kSteepestSlope),
                             "; a design with a thicker lens has a gentler front"}));
  }
  const std::string fault = frame_fault(options, setup);
  if (!fault.empty()) {
    throw InputError(fault + " while its back is cut; " + margin_option(options, setup) + " works");
  }
}

/// A lens that lies on the frame of its front's cut.
void validate_frame(const CamOptions& options, const OpticalSetup& setup) {
  const std::string fault = frame_fault(options, setup);
  if (!fault.empty()) {
    throw InputError(joined({"--z-zero table: the lens's front is curved, and ", fault,
                             "; use stock or lens, or ", margin_option(options, setup)}));
  }
  if (cuts_outline(options, setup)) {
    throw InputError(
        "--z-zero table: the tabs of an outline need material at the blank's underside, which the "
        "front's cut has taken; use --cut-outline never, and saw the lens out");
  }
}

/// A lens with a curved front lies in a nest during the cut, and its blank already has the front;
/// or it lies on the frame that the front's cut left.
void validate_front(const CamOptions& options, const OpticalSetup& setup) {
  if (!setup.front || options.part != PartKind::kLens || options.face == CutFace::kFront) return;
  if (lies_on_frame(options, setup)) return validate_frame(options, setup);
  if (options.z_zero == ZZero::kTable) {
    throw InputError(
        "--z-zero table: the lens's front is curved and has no plane to lie on; use stock or lens");
  }
  const auto* const sphere = std::get_if<SphericalFront>(&*setup.front);
  if (sphere == nullptr) return;  // A height map continues straight beyond the lens.
  const double margin = options.workshop.stock.margin;
  const Eigen::Vector2d middle = 0.5 * setup.lens_size;
  const Eigen::Vector2d reach = (sphere->apex.head<2>() - middle).cwiseAbs() + middle;
  const double radius = std::abs(sphere->radius);
  if ((reach.array() + margin).matrix().norm() < radius) return;
  // (x + m)² + (y + m)² = R², rounded down.
  const double sum = reach.sum();
  const double most =
      0.5 * (std::sqrt(sum * sum - 2.0 * (reach.squaredNorm() - radius * radius)) - sum);
  refuse("stock.margin", margin,
         "the lens's front, a sphere of radius " + shortest_text(radius) +
             " mm, is too small for a blank of that margin; " +
             decimal_text(std::floor(10.0 * most) / 10.0, 1) + " mm works");
}

/// Fails before hours are spent on programs that the controller could not read.
void validate_tool_numbers(const CamOptions& options) {
  if (!options.post.changes_tools()) return;
  const Process& process = options.workshop.process;
  const GcodeDialect& reader = options.post.reader;
  const auto check = [&](int tool) {
    if (tool <= reader.max_tool) return;
    refuse("tool number", tool,
           "is above " + std::to_string(reader.max_tool) + ", the largest that a post read as " +
               reader.name + " can call; number the tool from 1 to " +
               std::to_string(reader.max_tool) + " in the workshop");
  };
  check(process.finish.tool);
  check(process.finish.large_tool);
  if (process.rough.enabled) check(process.rough.tool);
  if (process.semi.enabled) check(process.semi.tool);
  if (options.outline_tool > 0) check(options.outline_tool);
}

}  // namespace

const char* words_for(SurfaceModel surface) {
  switch (surface) {
    case SurfaceModel::kFacet:
      return "facets of the mesh";
    case SurfaceModel::kSmooth:
      break;
    case SurfaceModel::kSpline:
      return "the lens's spline";
  }
  return "smooth, over the mesh";
}

const char* words_for(ZZero zero) {
  switch (zero) {
    case ZZero::kStock:
      return "top of the blank";
    case ZZero::kLens:
      return "highest point of the finished surface";
    case ZZero::kTable:
      break;
  }
  return "the face that the blank lies on";
}

Eigen::Vector2d size_to_cut(const CamOptions& options, const OpticalSetup& setup) {
  const double shrinkage = options.part == PartKind::kMould ? options.shrinkage : 0.0;
  return setup.lens_size / (1.0 - shrinkage);
}

double sample_spacing(const CamOptions& options, const Passes& passes) {
  if (options.sample_spacing > 0.0) return options.sample_spacing;
  const PolishModel& polish = options.workshop.polish;
  const double spacing = polish.floor > 0.0
                             ? passes.pitch / kSamplesPerFloor
                             : std::max(passes.pitch / kSamplesPerRow, polish.sigma / 3.0);
  return std::clamp(spacing, cam_limit::kFinestSample, cam_limit::kCoarsestSample);
}

Eigen::Vector2d sample_spacings(const CamOptions& options, const OpticalSetup& setup,
                                const Passes& passes) {
  const double across = sample_spacing(options, passes);
  Eigen::Vector2d spacings = Eigen::Vector2d::Constant(across);
  if (passes.cross) return spacings;
  // Scallops do not vary along passes. A Gaussian's weights σ apart sum to its integral within
  // 5e-9.
  const int axis = passes.axis;
  const double pixel = setup.lens_size[axis] / setup.pixels[axis];
  const PolishModel& polish = options.workshop.polish;
  const double by_rows = polish.floor > 0.0 ? passes.pitch / 2.0 : kAlongPasses * across;
  const double along = std::min({by_rows, polish.sigma, kAlongPixel * pixel});
  spacings[axis] = std::max(across, along);
  return spacings;
}

Eigen::Vector2d scallop_spacings(const CamOptions& options, const OpticalSetup& setup,
                                 const Passes& passes) {
  Eigen::Vector2d spacings = sample_spacings(options, setup, passes);
  if (passes.cross) return spacings;
  const int axis = passes.axis;
  const double pixel = setup.lens_size[axis] / setup.pixels[axis];
  spacings[axis] =
      std::max(spacings[axis], std::min(kAlongScallops * spacings[axis], kScallopPixel * pixel));
  return spacings;
}

double frame_width(const CamOptions& options, const OpticalSetup& setup) {
  const Workshop& workshop = options.workshop;
  const double apron = apron_to_cut(options);
  const Eigen::Vector2d around = Eigen::Vector2d::Constant(apron);
  const Eigen::AlignedBox2d cut(-around, Eigen::Vector2d(setup.lens_size + around));
  // The front's height 0 is the lowest place of its cut, and of the lens the nearest to the back.
  const double relief = 0.0 - lowest_of(*height_map_of(setup), cut);
  const Eigen::AlignedBox3d box(Eigen::Vector3d(cut.min().x(), cut.min().y(), 0.0),
                                Eigen::Vector3d(cut.max().x(), cut.max().y(), relief));
  // The finishing ball turns a radius beyond the apron.
  const double reach = std::max(rough_reach(workshop, box, relief + workshop.stock.allowance),
                                finishing_ball(options).diameter);
  return workshop.stock.margin - apron - reach;
}

double margin_for_frame(const CamOptions& options, const OpticalSetup& setup) {
  const double more =
      frame_needed(options.workshop.process, options.workshop) - frame_width(options, setup);
  return std::ceil(10.0 * (options.workshop.stock.margin + more)) / 10.0;
}

bool lies_on_frame(const CamOptions& options, const OpticalSetup& setup) {
  return options.face == CutFace::kBack && options.part == PartKind::kLens &&
         options.z_zero == ZZero::kTable && height_map_of(setup) != nullptr;
}

std::string tolerance_fault(const CamOptions& options, const OpticalSetup& setup) {
  if (larger_ball(options) != nullptr) {
    return "draws parts of one finishing ball only: set finish.large_tool = 0";
  }
  if (setup.outline) return "draws parts of rectangular lenses only";
  if (options.face == CutFace::kFront) return "draws parts whose back is cut";
  // PartModel polishes heights without scallops.
  if (options.workshop.polish.sigma == 0.0) return "draws parts that are polished only";
  return "";
}

void validate_shrinkage(const CamOptions& options) {
  if (options.shrinkage == 0.0 || options.part == PartKind::kMould) return;
  refuse("--shrinkage", options.shrinkage,
         "is of casts from a mould; use --part mould, or leave it out");
}

void validate(const CamOptions& options, const OpticalSetup& setup) {
  validate(options.workshop, "workshop");
  require_limits(options);
  validate_shrinkage(options);
  const Tool& ball = options.workshop.tool(options.workshop.process.finish.tool);
  const double smallest = setup.lens_size.minCoeff();
  if (!(ball.diameter < smallest)) {
    refuse(
        "--tool-diameter", ball.diameter,
        "must be smaller than the lens, whose shorter side is " + shortest_text(smallest) + " mm");
  }
  if (const Tool* const large = larger_ball(options); large && !(large->diameter < smallest)) {
    refuse("finish.large_tool", large->number,
           "its diameter, " + shortest_text(large->diameter) +
               " mm, must be smaller than the lens, whose shorter side is " +
               shortest_text(smallest) + " mm");
  }
  validate_tool_numbers(options);
  validate_decimals(options);
  validate_sampling(options);
  validate_tolerances(options, setup);
  validate_wavelength(options, setup);
  validate_margin(options);
  validate_face(options, setup);
  validate_front(options, setup);
  validate_outline(options);
}

std::vector<Eigen::Vector2d> edge_of(const OpticalSetup& setup) {
  if (setup.outline) return setup.outline->points;
  const Eigen::Vector2d& size = setup.lens_size;
  return {{0.0, 0.0}, {size.x(), 0.0}, size, {0.0, size.y()}};
}

bool cuts_outline(const CamOptions& options, const OpticalSetup& setup) {
  if (options.part == PartKind::kMould || options.face == CutFace::kFront) return false;
  if (options.cut_outline == OutlineWish::kIfShaped) return setup.outline.has_value();
  return options.cut_outline == OutlineWish::kAlways;
}

namespace {

constexpr double kMegabyte = 1e6;

/// Number of a tool in a process.
using ToolNumber = int (*)(const Process&);
constexpr ToolNumber kBall = [](const Process& process) { return process.finish.tool; };
constexpr ToolNumber kRougher = [](const Process& process) { return process.rough.tool; };

/// A tool of the workshop, which a file replaces as a whole.
Tool& tool_of(CamOptions& o, ToolNumber number) {
  const int wanted = number(o.workshop.process);
  for (Tool& tool : o.workshop.tools) {
    if (tool.number == wanted) return tool;
  }
  throw InputError("--workshop: there is no tool " + std::to_string(wanted));
}

/// A number of the finishing ball.
void describe_ball(Description& d, CamOptions& o, const char* name, double Tool::*member,
                   const Field& key, const char* help) {
  d.number(
      name, [&o, member]() -> double& { return tool_of(o, kBall).*member; }, key.limits, key.unit,
      help);
}

/// The diameter of a tool, whose flutes and neck keep their proportions; none where the workshop
/// has no such tool, which a disabled process may name.
void describe_diameter(Description& d, CamOptions& o, const char* name, ToolNumber number,
                       const Field& key, const char* help) {
  Field& field = d.like(key, name, help);
  field.get = [&o, number] {
    const Tool* const found = o.workshop.find_tool(number(o.workshop.process));
    return found == nullptr ? FieldValue() : FieldValue(found->diameter);
  };
  field.set = [&o, number](const FieldValue& value) {
    Tool& tool = tool_of(o, number);
    tool = resized(tool, number_of(value));
  };
}

void describe_tools(Description& d, CamOptions& o, const Description& shop) {
  const Field diameter = shop.at("tool.diameter");
  describe_diameter(d, o, "--tool-diameter", kBall, diameter, "finishing ball-end mill");
  // A given pitch takes precedence over one from a scallop.
  Field& pitch = d.like(shop.at("finish.pitch"), "--pitch", "maximum stepover between rows");
  pitch.set = [&finish = o.workshop.process.finish](const FieldValue& value) {
    finish.set_pitch(number_of(value));
  };
  pitch.essential = true;
  d.like(shop.at("finish.scallop"), "--scallop",
         "height of scallops; if above 0, the pitch follows from it");
  describe_ball(d, o, "--spindle", &Tool::spindle_rpm, shop.at("tool.spindle_rpm"),
                "finishing speed");
  describe_ball(d, o, "--feed", &Tool::feed, shop.at("tool.feed"), "finishing feed");
  describe_ball(d, o, "--plunge", &Tool::plunge, shop.at("tool.plunge"), "feed straight down");
  describe_diameter(d, o, "--rough-tool", kRougher, diameter, "diameter of the roughing tool");
  d.flag("--force", o.force,
         "replace files that lensforge did not write, or that were changed since");
}

void describe_raster(Description& d, CamOptions& o, const Description& shop) {
  Process& process = o.workshop.process;
  d.like(shop.at("finish.along"), "--along", "axis along which finishing rows run");
  d.like(shop.at("finish.style"), "--order", "finishing rows to and fro, or all one way");
  d.like(shop.at("finish.cross"), "--cross", "finish a second time, along the other axis");
  d.like(shop.at("finish.pencil"), "--pencil", "a last pass along the creases");
  d.like(shop.at("finish.tolerance"), "--tolerance",
         "largest distance of the path from the exact one");
  d.like(shop.at("finish.slope_tolerance"), "--slope-tolerance",
         "largest error of a move's direction");
  d.whole("--decimals", o.decimals, Limits::zero_or(4, 6),
          "digits after the point; 0: as the tolerances ask");
  d.without("--no-arcs", o.arcs, "straight finishing moves only");
  d.without("--no-rough", process.rough.enabled, "no roughing program");
  d.without("--no-semi", process.semi.enabled, "no semi-finishing program");
}

void describe_outline(Description& d, CamOptions& o) {
  d.word("--cut-outline", o.cut_outline,
         {{"auto", OutlineWish::kIfShaped},
          {"always", OutlineWish::kAlways},
          {"never", OutlineWish::kNever}},
         "cut the lens out of its blank, last; auto: if it has an outline");
  d.whole("--outline-tool", o.outline_tool, Limits::between(0, 9999),
          "number of the flat end mill for it; 0: the roughing tool");
  d.whole("--tabs", o.tabs.count, Limits::between(0, cam_limit::kMaxTabs),
          "tabs that hold the lens in its frame until they are snapped; fewer where they do not "
          "fit");
  d.length("--tab-width", o.tabs.width,
           Limits::between(cam_limit::kThinnestTab, cam_limit::kWidestTab),
           "of a tab along the outline");
  d.length("--tab-height", o.tabs.height,
           Limits::between(cam_limit::kThinnestTab, cam_limit::kHighestTab),
           "of a tab above the blank's underside");
}

/// The surfaces of a lens that can be cut.
Choices<std::optional<SurfaceModel>> surfaces() {
  Choices<std::optional<SurfaceModel>> words{{"designed", std::nullopt}};
  for (const auto& [word, model] : named_models()) words.emplace_back(word, model);
  return words;
}

void describe_blank(Description& d, CamOptions& o, const Description& shop) {
  d.like(shop.at("stock.allowance"), "--stock",
         "top of the blank above the surface's highest point");
  d.like(shop.at("stock.margin"), "--margin", "blank beyond the lens on every side");
  d.like(shop.at("process.safe_height"), "--safe-height",
         "height of rapid moves above the top of the blank");
  d.word("--z-zero", o.z_zero,
         {{"stock", ZZero::kStock}, {"table", ZZero::kTable}, {"lens", ZZero::kLens}},
         "Z0: top of the blank, the table below it, or the lens's highest point; under a shaped "
         "front the table is below the frame that --face front leaves");
  d.word("--part", o.part, {{"lens", PartKind::kLens}, {"mould", PartKind::kMould}},
         "mill the lens, or the mould to cast it in");
  d.word("--face", o.face, {{"back", CutFace::kBack}, {"front", CutFace::kFront}},
         "the face to cut: back, where light leaves the lens, or a front that is a height map, "
         "first, into a flat blank that is turned over afterwards")
      .essential = true;
  d.number("--shrinkage", o.shrinkage, Limits::between(0, kMaxShrinkage), "",
           "shrinkage of the cast part, share of a length");
  d.word("--surface", o.surface, surfaces(),
         "cut what was designed, the smooth surface over the mesh, its facets, or a lens's own "
         "spline");
}

/// The size limit of a program, stored in bytes.
void describe_split(Description& d, std::uintmax_t& bytes) {
  const Limits limits =
      Limits::zero_or(static_cast<double>(kSmallestProgramLimit) / kMegabyte, 1e5);
  d.add({{"--split", FieldKind::kNumber,
          "split programs above this size; 0: the dialect's own limit", limits, "MB"},
         [&bytes] { return FieldValue(static_cast<double>(bytes) / kMegabyte); },
         [&bytes](const FieldValue& value) {
           bytes = static_cast<std::uintmax_t>(std::llround(number_of(value) * kMegabyte));
         }});
}

void describe_programs(Description& d, CamOptions& o) {
  describe_post(d, o.post, o.workshop);
  d.word("--programs", o.grouping,
         {{"operation", ProgramGrouping::kOperation},
          {"tool", ProgramGrouping::kTool},
          {"one", ProgramGrouping::kAll}},
         "a file per operation, per tool, or one where the dialect changes tools")
      .essential = true;
  describe_split(d, o.largest_file);
  describe_spindle_start(d, o.spin_up, o.coolant);
}

}  // namespace

void describe_light(Description& d, CamOptions& options, const std::string& picture) {
  d.word("--light-model", options.light,
         {{"auto", LightModel::kAuto}, {"rays", LightModel::kRays}, {"waves", LightModel::kWaves}},
         picture +
             ", by waves or by rays alone; auto: waves unless the lamp's image is much wider than "
             "diffraction, or the surface has creases");
  d.number("--wavelength", options.wavelength_nm, Limits::between(kMinWavelength, kMaxWavelength),
           "nm", "of the waves; white light is as 550");
}

namespace {

void describe_prediction(Description& d, CamOptions& o, const Description& shop) {
  d.without("--no-render", o.render, "programs only, without the predicted picture").essential =
      true;
  d.without("--no-remedies", o.remedies, "do not try what helps where most light leaks");
  describe_light(d, o, "the picture that is judged");
  d.whole(
       "--tolerances", o.tolerances, Limits::zero_or(cam_limit::kFewestParts, cam_limit::kMaxParts),
       "how sure the forecast is, and what matters: predict so many parts with the errors of the "
       "workshop's [tolerances]; 0: a few, for the range")
      .essential = true;
  d.without("--no-range", o.range, "no range of parts with errors beside the forecast");
  d.whole("--tolerance-seed", o.tolerance_seed, Limits::between(0, cam_limit::kLargestSeed),
          "seed of the random numbers of --tolerances");
  d.like(shop.at("polish.sigma"), "--polish-sigma",
         "polishing leaves exp(-(σk/√2)^order) of a ripple of wave number k");
  d.like(
      shop.at("polish.order"), "--polish-order",
      "2: pads and wheels, an average with a Gaussian of σ; 4: a levelling film, flame and vapour");
  d.like(shop.at("polish.floor"), "--polish-floor",
         "share of every ripple that polishing leaves however narrow it is");
  d.like(shop.at("polish.roughness"), "--roughness",
         "rms roughness that polishing leaves, which scatters light; 0: haze is not counted");
  d.like(shop.at("polish.correlation"), "--correlation",
         "correlation length of the roughness: a shorter one scatters farther");
  d.like(shop.at("polish.rim_depth"), "--rim-depth",
         "extra depth that polishing removes at the rim");
  d.like(shop.at("polish.rim_length"), "--rim-length",
         "distance from the rim over which the extra depth falls to a third");
  d.length("--sample-spacing", o.sample_spacing,
           Limits::zero_or(cam_limit::kFinestSample, cam_limit::kCoarsestSample),
           "spacing of samples of the milled surface across its passes, up to three times that "
           "along them; 0: chosen from pitch and σ");
  d.number("--dark-below", o.leakage.dark_below, Limits::between(0, cam_limit::kDark), "",
           "parts of the picture below this share of its mean are dark");
}

/// A limit of quality is advice until an option states it.
void describe_limits(Description& d, CamOptions& o) {
  const Limits any = Limits::between(0, cam_limit::kLimit);
  const auto advice = [&o](const char* key, Field& field) {
    field.set = [&o, key, set = field.set](const FieldValue& value) {
      set(value);
      o.stated_limits.insert(key);
    };
  };
  CutLimits& limits = o.limits;
  advice("leakage", d.number("--max-leakage", limits.leakage, any, "",
                             "verdict: share of light that may land where the design puts less"));
  advice("dark_flux", d.number("--max-dark", limits.dark_flux, any, "",
                               "verdict: share of light that may land in dark parts"));
  advice("mae_increase", d.number("--max-mae-increase", limits.mae_increase, any, "",
                                  "verdict: MAE of the part above that of the design"));
  d.length("--max-gouge", limits.gouge, any, "verdict: deepest cut below the exact path");
  advice("excess",
         d.length("--max-excess", limits.excess, any, "verdict: highest path above the exact one"));
  advice("slope", d.number("--max-slope", limits.slope, any, "rad",
                           "verdict: error of the path's direction over 5 µm"));
  advice("fillet_depth", d.length("--max-fillet", limits.fillet_depth, any,
                                  "verdict: material that the ball leaves in creases"));
}

}  // namespace

MadeBy made_by(const CamOptions& options, bool robust) {
  const Workshop& shop = options.workshop;
  const double spread = robust ? shop.tolerances.polish_sigma : 0.0;
  if (options.part == PartKind::kPrint) {
    const Printer& printer = shop.printer;
    return {.pitch = printer.cell().y(),
            .polish_sigma = printer.film_sigma,
            .polish_spread = spread,
            .polish_order = printer.film_order};
  }
  const FinishProcess& finish = shop.process.finish;
  const MadeBy made{max_pitch(finish, shop.tool(finish.tool).radius(), kUnknownSlope),
                    finish.along == PassAxis::kX,
                    shop.polish.sigma,
                    shop.polish.rim_depth,
                    shop.polish.rim_length,
                    spread,
                    shop.polish.order,
                    shop.polish.floor,
                    shop.polish.roughness,
                    shop.polish.correlation};
  return options.part == PartKind::kMould ? made.cast(options.shrinkage) : made;
}

void describe(Description& d, CamOptions& options) {
  const Description shop = description_of(options.workshop);
  describe_tools(d, options, shop);
  describe_raster(d, options, shop);
  describe_blank(d, options, shop);
  describe_outline(d, options);
  describe_programs(d, options);
  describe_prediction(d, options, shop);
  describe_limits(d, options);
}

}  // namespace lensforge
