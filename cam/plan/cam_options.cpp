// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/plan/cam_options.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "cam/milled/mould.h"
#include "cam/plan/finishing.h"
#include "cam/post/program_writer.h"
#include "core/error.h"
#include "core/lens/optical_surface.h"
#include "core/text/number_text.h"
#include "core/text/option_field.h"
#include "core/text/toml_fields.h"

namespace lensforge {
namespace {

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

void validate_tolerances(const CamOptions& options) {
  if (options.tolerances > 0 && !options.render) {
    refuse("--tolerances", options.tolerances,
           "needs the predicted picture: leave out --no-render, or use --tolerances 0");
  }
  if (options.tolerances > 0 && larger_ball(options) != nullptr) {
    refuse("--tolerances", options.tolerances,
           "draws parts of one finishing ball only: set finish.large_tool = 0, or use "
           "--tolerances 0");
  }
}

/// Parts have the error of an extended source where the design assumes a point.
void validate_tolerances(const CamOptions& options, const OpticalSetup& setup) {
  if (options.tolerances == 0) return;
  if (setup.outline) {
    refuse("--tolerances", options.tolerances,
           "draws parts of rectangular lenses only; use --tolerances 0");
  }
  if (setup.extent.none() && !setup.front) return;
  refuse("--tolerances", options.tolerances,
         "draws parts with a flat front, for the light of a point or of one direction only; use "
         "--tolerances 0");
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

/// A lens with a curved front lies in a nest during the cut, and its blank already has the front.
void validate_front(const CamOptions& options, const OpticalSetup& setup) {
  if (!setup.front || options.part != PartKind::kLens) return;
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
             decimal_text(std::floor(10.0 * most) / 10.0, 1) + " mm would do");
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

double sample_spacing(const CamOptions& options) {
  if (options.sample_spacing > 0.0) return options.sample_spacing;
  const FinishProcess& finish = options.workshop.process.finish;
  const double pitch = finish_pitch(finish, options.workshop.tool(finish.tool).radius());
  return std::clamp(std::max(pitch / 6.0, options.workshop.polish.sigma / 3.0),
                    cam_limit::kFinestSample, cam_limit::kCoarsestSample);
}

Eigen::Vector2d sample_spacings(const CamOptions& options, const OpticalSetup& setup) {
  const FinishProcess& finish = options.workshop.process.finish;
  const double across = sample_spacing(options);
  Eigen::Vector2d spacings = Eigen::Vector2d::Constant(across);
  if (finish.cross) return spacings;
  // Scallops do not vary along passes. A Gaussian's weights σ apart sum to its integral within
  // 5e-9.
  const int axis = finish.along == PassAxis::kX ? 0 : 1;
  const double pixel = setup.lens_size[axis] / setup.pixels[axis];
  const double along =
      std::min({kAlongPasses * across, options.workshop.polish.sigma, kAlongPixel * pixel});
  spacings[axis] = std::max(across, along);
  return spacings;
}

Eigen::Vector2d scallop_spacings(const CamOptions& options, const OpticalSetup& setup) {
  const FinishProcess& finish = options.workshop.process.finish;
  Eigen::Vector2d spacings = sample_spacings(options, setup);
  if (finish.cross) return spacings;
  const int axis = finish.along == PassAxis::kX ? 0 : 1;
  const double pixel = setup.lens_size[axis] / setup.pixels[axis];
  spacings[axis] =
      std::max(spacings[axis], std::min(kAlongScallops * spacings[axis], kScallopPixel * pixel));
  return spacings;
}

void validate(const CamOptions& options, const OpticalSetup& setup) {
  validate(options.workshop, "workshop");
  require_limits(cam_fields(), options);
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
  validate_tolerances(options);
  validate_tolerances(options, setup);
  validate_front(options, setup);
  validate_outline(options);
}

std::vector<Eigen::Vector2d> edge_of(const OpticalSetup& setup) {
  if (setup.outline) return setup.outline->points;
  const Eigen::Vector2d& size = setup.lens_size;
  return {{0.0, 0.0}, {size.x(), 0.0}, size, {0.0, size.y()}};
}

bool cuts_outline(const CamOptions& options, const OpticalSetup& setup) {
  if (options.part == PartKind::kMould) return false;
  if (options.cut_outline == OutlineWish::kIfShaped) return setup.outline.has_value();
  return options.cut_outline == OutlineWish::kAlways;
}

namespace {

using O = CamOptions;
using R = Row<O>;
using Field = OptionField<O>;

constexpr double kMegabyte = 1e6;

/// The limits of one of the workshop's numbers (workshop_rule()).
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

const Tool& tool_of(const Workshop& workshop, int number) { return workshop.tool(number); }

constexpr auto kBallNumber = [](const Process& process) { return process.finish.tool; };
constexpr auto kRougherNumber = [](const Process& process) { return process.rough.tool; };
constexpr auto kBall = [](auto& o) -> auto& {
  return tool_of(o.workshop, kBallNumber(o.workshop.process));
};
constexpr auto kRougher = [](auto& o) -> auto& {
  return tool_of(o.workshop, kRougherNumber(o.workshop.process));
};
constexpr auto kFinish = [](auto& o) -> auto& { return o.workshop.process.finish; };

/// A member of a part of the options, which `at` returns.
template <class At, class Member>
auto in(At at, Member member) {
  return [ at, member ](auto& o) -> auto& { return std::invoke(member, at(o)); };
}

/// The diameter of a tool, whose flutes and neck keep their proportions; null where the workshop
/// has no such tool, which a disabled process may name.
template <class At, class Number>
Field diameter(const char* name, At tool, Number number, const char* help) {
  Field row = R::length(name, in(tool, &Tool::diameter), as_in_workshop("tool.diameter"), help);
  row.get = [number](const O& o) {
    const Tool* const found = o.workshop.find_tool(number(o.workshop.process));
    return found == nullptr ? nlohmann::json() : nlohmann::json(found->diameter);
  };
  row.set = [tool](O& o, const nlohmann::json& value) {
    tool(o) = resized(tool(o), value.get<double>());
  };
  return row;
}

/// A given pitch takes precedence over one from a scallop.
Field pitch_row() {
  Field row = R::length("--pitch", in(kFinish, &FinishProcess::pitch),
                        as_in_workshop("finish.pitch"), "maximum stepover between rows");
  row.set = [](O& o, const nlohmann::json& value) { kFinish(o).set_pitch(value.get<double>()); };
  return row;
}

OptionTable<O> tool_rows() {
  return {
      diameter("--tool-diameter", kBall, kBallNumber, "finishing ball-end mill"),
      pitch_row(),
      R::length("--scallop", in(kFinish, &FinishProcess::scallop), as_in_workshop("finish.scallop"),
                "height of scallops; if above 0, the pitch follows from it"),
      R::number("--spindle", in(kBall, &Tool::spindle_rpm), as_in_workshop("tool.spindle_rpm"),
                "rpm", "finishing speed"),
      R::number("--feed", in(kBall, &Tool::feed), as_in_workshop("tool.feed"), "mm/min",
                "finishing feed"),
      R::number("--plunge", in(kBall, &Tool::plunge), as_in_workshop("tool.plunge"), "mm/min",
                "feed straight down"),
      diameter("--rough-tool", kRougher, kRougherNumber, "diameter of the roughing tool"),
      R::flag("--force", &O::force,
              "replace files that lensforge did not write, or that were changed since")};
}

OptionTable<O> raster_rows() {
  return {R::word<PassAxis>("--along", in(kFinish, &FinishProcess::along),
                            {{"x", PassAxis::kX}, {"y", PassAxis::kY}},
                            "axis along which finishing rows run"),
          R::word<PassStyle>("--order", in(kFinish, &FinishProcess::style),
                             {{"zigzag", PassStyle::kZigzag},
                              {"climb", PassStyle::kClimb},
                              {"conventional", PassStyle::kConventional}},
                             "finishing rows to and fro, or all one way"),
          R::flag("--cross", in(kFinish, &FinishProcess::cross),
                  "finish a second time, along the other axis"),
          R::flag("--pencil", in(kFinish, &FinishProcess::pencil), "a last pass along the creases"),
          R::length("--tolerance", in(kFinish, &FinishProcess::tolerance),
                    as_in_workshop("finish.tolerance"),
                    "largest distance of the path from the exact one"),
          R::number("--slope-tolerance", in(kFinish, &FinishProcess::slope_tolerance),
                    as_in_workshop("finish.slope_tolerance"), "rad",
                    "largest error of a move's direction"),
          R::whole("--decimals", &O::decimals, Limits::zero_or(4, 6),
                   "digits after the point; 0: as the tolerances ask"),
          R::without("--no-arcs", &O::arcs, "straight finishing moves only"),
          R::without(
              "--no-rough", [](auto& o) -> auto& { return o.workshop.process.rough.enabled; },
              "no roughing program"),
          R::without(
              "--no-semi", [](auto& o) -> auto& { return o.workshop.process.semi.enabled; },
              "no semi-finishing program")};
}

OptionTable<O> outline_rows() {
  constexpr auto tabs = [](auto& o) -> auto& { return o.tabs; };
  return {R::word<OutlineWish>("--cut-outline", &O::cut_outline,
                               {{"auto", OutlineWish::kIfShaped},
                                {"always", OutlineWish::kAlways},
                                {"never", OutlineWish::kNever}},
                               "cut the lens out of its blank, last; auto: if it has an outline"),
          R::whole("--outline-tool", &O::outline_tool, Limits::between(0, 9999),
                   "number of the flat end mill for it; 0: the roughing tool"),
          R::whole("--tabs", in(tabs, &TabOptions::count), Limits::between(0, cam_limit::kMostTabs),
                   "tabs that hold the lens in its frame until they are snapped; fewer where they "
                   "do not fit"),
          R::length("--tab-width", in(tabs, &TabOptions::width),
                    Limits::between(cam_limit::kThinnestTab, cam_limit::kWidestTab),
                    "of a tab along the outline"),
          R::length("--tab-height", in(tabs, &TabOptions::height),
                    Limits::between(cam_limit::kThinnestTab, cam_limit::kHighestTab),
                    "of a tab above the blank's underside")};
}

/// The surfaces of a lens that can be cut.
R::Choices<std::optional<SurfaceModel>> surfaces() {
  R::Choices<std::optional<SurfaceModel>> words{{"designed", std::nullopt}};
  for (const auto& [word, model] : named_models()) words.emplace_back(word, model);
  return words;
}

OptionTable<O> blank_rows() {
  using Surface = std::optional<SurfaceModel>;
  return {
      R::length(
          "--stock", [](auto& o) -> auto& { return o.workshop.stock.allowance; },
          as_in_workshop("stock.allowance"), "top of the blank above the surface's highest point"),
      R::length(
          "--margin", [](auto& o) -> auto& { return o.workshop.stock.margin; },
          as_in_workshop("stock.margin"), "blank beyond the lens on every side"),
      R::length(
          "--safe-height", [](auto& o) -> auto& { return o.workshop.process.safe_height; },
          as_in_workshop("process.safe_height"),
          "height of rapid moves above the top of the blank"),
      R::word<ZZero>("--z-zero", &O::z_zero,
                     {{"stock", ZZero::kStock}, {"table", ZZero::kTable}, {"lens", ZZero::kLens}},
                     "Z0: top of the blank, the table below it, or the lens's highest point"),
      R::word<PartKind>("--part", &O::part,
                        {{"lens", PartKind::kLens}, {"mould", PartKind::kMould}},
                        "mill the lens, or the mould to cast it in"),
      R::number("--shrinkage", &O::shrinkage, Limits::between(0, kMaxShrinkage), "",
                "shrinkage of the cast part, share of a length"),
      R::word<Surface>("--surface", &O::surface, surfaces(),
                       "cut what was designed, the smooth surface over the mesh, its facets, or a "
                       "lens's own spline")};
}

/// The size limit of a program, stored in bytes.
Field split() {
  const Limits limits =
      Limits::zero_or(static_cast<double>(kSmallestProgramLimit) / kMegabyte, 1e5);
  Field row{{"--split",
             OptionKind::kNumber,
             "split programs above this size; 0: the dialect's own limit",
             limits,
             "MB",
             {}},
            [](const O& o) { return static_cast<double>(o.largest_file) / kMegabyte; },
            [](O& o, const nlohmann::json& value) {
              o.largest_file =
                  static_cast<std::uintmax_t>(std::llround(value.get<double>() * kMegabyte));
            },
            {},
            {}};
  row.stored = row.get;
  return row;
}

Field post() {
  Field row = R::text(
      "--post", [](auto& o) -> auto& { return o.post.name; }, "NAME|FILE.toml",
      "dialect: linuxcnc, grbl, grblhal, fanuc, weihong, or a description of one");
  row.set = [](O& o, const nlohmann::json& value) { o.post = find_post(value, "--post"); };
  return row;
}

OptionTable<O> program_rows() {
  return {post(),
          R::word<ProgramGrouping>(
              "--programs", &O::grouping,
              {{"operation", ProgramGrouping::kOperation},
               {"tool", ProgramGrouping::kTool},
               {"one", ProgramGrouping::kAll}},
              "a file per operation, per tool, or one where the dialect changes tools"),
          split(),
          R::number("--spin-up", &O::spin_up, Limits::between(0, kMaxPause), "s",
                    "wait after spindle start"),
          R::word<Coolant>(
              "--coolant", &O::coolant,
              {{"off", Coolant::kOff}, {"mist", Coolant::kMist}, {"flood", Coolant::kFlood}},
              "coolant")};
}

OptionTable<O> prediction_rows() {
  constexpr auto polish = [](auto& o) -> auto& { return o.workshop.polish; };
  return {
      R::without("--no-render", &O::render, "programs only, without the predicted picture"),
      R::without("--no-remedies", &O::remedies, "do not try what helps where most light leaks"),
      R::whole("--tolerances", &O::tolerances,
               Limits::zero_or(cam_limit::kFewestParts, cam_limit::kMostParts),
               "how sure the forecast is: predict so many parts with the errors of the workshop's "
               "[tolerances]; 0: none"),
      R::whole("--tolerance-seed", &O::tolerance_seed, Limits::between(0, cam_limit::kLargestSeed),
               "seed of the random numbers of --tolerances"),
      R::length("--polish-sigma", in(polish, &PolishModel::sigma), as_in_workshop("polish.sigma"),
                "polishing averages heights with a Gaussian of this σ"),
      R::length("--rim-depth", in(polish, &PolishModel::rim_depth),
                as_in_workshop("polish.rim_depth"),
                "extra depth that polishing removes at the rim"),
      R::length("--rim-length", in(polish, &PolishModel::rim_length),
                as_in_workshop("polish.rim_length"),
                "distance from the rim over which the extra depth falls to a third"),
      R::length("--sample-spacing", &O::sample_spacing,
                Limits::zero_or(cam_limit::kFinestSample, cam_limit::kCoarsestSample),
                "spacing of samples of the milled surface across its passes, up to three times "
                "that along "
                "them; 0: chosen from pitch and σ"),
      R::number(
          "--dark-below", [](auto& o) -> auto& { return o.leakage.dark_below; },
          Limits::between(0, cam_limit::kDark), "",
          "parts of the picture below this share of its mean are dark")};
}

/// A limit of quality, which is advice until an option states it.
Field stated(const char* key, Field row) {
  row.set = [key, set = row.set](O& o, const nlohmann::json& value) {
    set(o, value);
    o.stated_limits.insert(key);
  };
  return row;
}

OptionTable<O> limit_rows() {
  constexpr auto limits = [](auto& o) -> auto& { return o.limits; };
  const Limits any = Limits::between(0, cam_limit::kLimit);
  const auto number = [&](const char* name, auto member, const char* unit, const char* help) {
    return R::number(name, in(limits, member), any, unit, help);
  };
  const auto length = [&](const char* name, auto member, const char* help) {
    return R::length(name, in(limits, member), any, help);
  };
  return {stated("leakage", number("--max-leakage", &CutLimits::leakage, "",
                                   "verdict: share of light that may land where the design puts "
                                   "less")),
          stated("dark_flux", number("--max-dark", &CutLimits::dark_flux, "",
                                     "verdict: share of light that may land in dark parts")),
          stated("mae_increase", number("--max-mae-increase", &CutLimits::mae_increase, "",
                                        "verdict: MAE of the part above that of the design")),
          length("--max-gouge", &CutLimits::gouge, "verdict: deepest cut below the exact path"),
          stated("excess", length("--max-excess", &CutLimits::excess,
                                  "verdict: highest path above the exact one")),
          stated("slope", number("--max-slope", &CutLimits::slope, "rad",
                                 "verdict: error of the path's direction over 5 µm")),
          stated("fillet_depth", length("--max-fillet", &CutLimits::fillet_depth,
                                        "verdict: material that the ball leaves in creases"))};
}

}  // namespace

const OptionTable<CamOptions>& cam_fields() {
  static const OptionTable<O> table = [] {
    OptionTable<O> all;
    for (const OptionTable<O>& rows : {tool_rows(), raster_rows(), blank_rows(), outline_rows(),
                                       program_rows(), prediction_rows(), limit_rows()}) {
      all.insert(all.end(), rows.begin(), rows.end());
    }
    return all;
  }();
  return table;
}

}  // namespace lensforge
