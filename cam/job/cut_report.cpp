// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/job/cut_report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "cam/plan/finishing.h"
#include "cam/post/program_part.h"
#include "core/io/lens_folder.h"
#include "core/optics/front.h"
#include "core/optics/light_path.h"
#include "core/optics/polish_transfer.h"
#include "core/optics/refraction.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

/// Depth of tools below the blank's underside, mm.
double depth_in_table(const WrittenCut& cut) {
  double deepest = 0.0;
  for (const Collision& collision : cut.checks.collisions()) {
    if (collision.obstacle == kTableObstacle) deepest = std::max(deepest, collision.worst.value);
  }
  return deepest;
}

double steep_moves(const WrittenCut& cut) {
  double moves = 0.0;
  for (const SteepDescent& descent : cut.checks.descents()) {
    moves += static_cast<double>(descent.moves);
  }
  return moves;
}

/// True if a part that does not cut touches the part or its blank while the outline is cut.
bool is_short_outline_tool(const Collision& collision, int tool) {
  return collision.tool == tool && collision.operation.starts_with("outline") &&
         collision.part != "cutter" &&
         (collision.obstacle == "the blank" || collision.obstacle == "the lens");
}

/// For a single cut: a nest's blank has a thickness of its own.
std::string outline_warning(const WrittenCut& cut) {
  if (cut.shared || !cut.setup.cuts_outline()) return "";
  const double usual = Stock{}.allowance;
  return outline_tool_advice(
      cut.setup, cut.checks, cut.setup.blank.max().z(),
      {"--stock " + trimmed_decimal(usual, 3), cut.setup.box.max().z() + usual});
}

/// Depth of a tool in a slot of its own width before a part that does not cut gets into it or
/// beside it, mm.
double free_length(const Tool& tool) {
  double length = tool.flute_length;
  for (const CutterProfile& part : shank_profiles(tool)) length = std::min(length, part.base);
  return length;
}

/// Checks of what the machine must not do: collisions, descents too steep for their feed, motion
/// below the blank or beyond the travel.
std::vector<LimitCheck> safety_checks(const WrittenCut& cut) {
  const auto collisions =
      static_cast<double>(cut.checks.collisions().size() + cut.checks.watch().faults().size());
  std::vector<LimitCheck> checks{
      {"collisions", "collisions", collisions, 0.0, "", 0},
      {"table", "cut below the blank", depth_in_table(cut), 0.0, "mm", 4}};
  const Eigen::Vector3d extent = cut.checks.watch().extent();
  const Eigen::Vector3d& travel = cut.setup.options.workshop.machine.travel;
  for (int axis = 0; axis < 3; ++axis) {
    checks.push_back({std::string("travel_") + "xyz"[axis],
                      std::string("machine travel along ") + "XYZ"[axis], extent[axis],
                      travel[axis], "mm", 2});
  }
  checks.push_back({"descents", "moves down into material too steep for their feed",
                    steep_moves(cut), 0.0, "", 0});
  return checks;
}

/// The same in sentences; empty if nothing was found.
std::vector<std::string> safety_warnings(const WrittenCut& cut) {
  std::vector<std::string> warnings;
  for (const Collision& collision : cut.checks.collisions()) {
    warnings.push_back(collision.sentence());
  }
  for (const SteepDescent& descent : cut.checks.descents()) {
    warnings.push_back(descent.sentence(cut.programs.names[descent.first.program]));
  }
  for (const std::string& fault : cut.checks.watch().faults()) warnings.push_back(fault);
  for (const std::string& sentence :
       {outline_warning(cut),
        travel_fault(cut.checks.watch().extent(), cut.setup.options.workshop.machine.travel)}) {
    if (!sentence.empty()) warnings.push_back(sentence);
  }
  return warnings;
}

}  // namespace

std::string outline_tool_advice(const CutSetup& setup, const ProgramChecks& checks,
                                double thickness, const ThinBlank& thin) {
  const Tool tool = setup.outline_cut().tool;
  const std::vector<Collision>& collisions = checks.collisions();
  if (std::none_of(collisions.begin(), collisions.end(), [&](const Collision& collision) {
        return is_short_outline_tool(collision, tool.number);
      })) {
    return "";
  }
  const std::string fault =
      joined({"--outline-tool ", std::to_string(tool.number), ": goes ",
              trimmed_decimal(free_length(tool), 3), " mm deep at most, too short for a blank of ",
              trimmed_decimal(thickness, 3), " mm; "});
  const std::vector<Tool>& tools = setup.options.workshop.tools;
  const auto other = std::find_if(tools.begin(), tools.end(), [&](const Tool& one) {
    return one.shape == CutterShape::kFlat && one.diameter <= tool.diameter &&
           free_length(one) >= thickness;
  });
  if (other != tools.end()) {
    return joined({fault, "--outline-tool ", std::to_string(other->number), " works"});
  }
  if (thin.thickness < thickness && thin.thickness <= free_length(tool)) {
    return joined({fault, thin.option, " works"});
  }
  return joined({fault, "a flat end mill with flutes of ",
                 trimmed_decimal(std::ceil(1e3 * thickness) / 1e3, 3),
                 " mm and nothing wider below that works"});
}

namespace {

constexpr double kMicrometres = 1e3;
constexpr double kSecondsPerMinute = 60.0;

/// Share by which a pitch may differ from the one that a lens was designed for: the variance of
/// what rows average, p²/12, then changes by 2 %.
constexpr double kSamePitch = 0.01;

/// Of a material's refractive index: makers state acrylic as 1.49 to 1.492, and an error of 0.005
/// changes the refraction by 1 %.
constexpr double kIndexTolerance = 0.005;

std::string mm(double value, int decimals) { return decimal_text(value, decimals) + " mm"; }

/// Faces that lie down and that are cut. If no light passes the part, its underside needs no
/// polish.
std::string up_words(const CutSetup& setup) {
  const Lens& lens = *setup.lens;
  if (setup.options.part == PartKind::kMould) return "the mould's cavity is cut from above";
  if (setup.is_front()) {
    return "the front, where light enters, is cut from above into the flat blank, which lies on "
           "what becomes its back";
  }
  if (setup.frame) {
    return "the front that was cut before down, on the frame around it; the optical surface is cut "
           "from above";
  }
  if (!traits(lens.setup.body).transmits) {
    return joined({"underside down, which needs no polish; the ", traits(lens.setup.body).name,
                   "'s surface is cut from above"});
  }
  if (lens.setup.front) {
    const bool sphere = std::holds_alternative<SphericalFront>(*lens.setup.front);
    return std::string("polished ") + (sphere ? "spherical" : "curved") +
           " face down, in a nest; the optical surface is cut from above";
  }
  return "polished flat face down; the optical surface is cut from above";
}

/// Place of a front in program coordinates.
std::string place_words(const CutSetup& setup, const SphericalFront& front) {
  return std::string(front.radius > 0.0 ? "bulging" : "hollow") + " sphere of radius " +
         mm(std::abs(front.radius), 2) + ", there before the first cut: its apex lies at X " +
         decimal_text(front.apex.x(), 3) + " Y " + decimal_text(front.apex.y(), 3) + " Z " +
         decimal_text(front.apex.z() + setup.z_offset, 3) + " of the program, " +
         mm(setup.blank.max().z() - front.apex.z(), 3) + " below the top of the blank";
}
std::string place_words(const CutSetup& setup, const HeightFront& front) {
  return joined({"height map, there before the first cut: the corner of ", lens_file::kFront,
                 " at its lower left lies at X 0.000 Y 0.000, that at its upper right at X ",
                 decimal_text(front.size.x(), 3), " Y ", decimal_text(front.size.y(), 3),
                 ", its height 0 at Z ", decimal_text(setup.z_offset, 3), " of the program, ",
                 mm(setup.blank.max().z(), 3), " below the top of the blank; beyond the lens it ",
                 "goes on straight"});
}

/// Required place of the blank's front, and the effect of an error.
std::string front_words(const CutSetup& setup) {
  const Lens& lens = *setup.lens;
  const Eigen::Vector2d middle = 0.5 * lens.setup.lens_size;
  const double top = lens.surface.vertices.row(2).mean();
  const double shift = shift_by_front(lens.setup, {middle.x(), middle.y(), top});
  return std::visit([&setup](const auto& front) { return place_words(setup, front); },
                    lens.setup.front.value()) +
         "; 0.1 mm aside moves the picture by " + mm(0.1 * shift, 3) +
         ". The nest may reach up to Z " + decimal_text(setup.z_offset, 3) + ", no higher";
}

/// The blank including the part of its front below z = 0.
Eigen::AlignedBox3d whole_box(const CutSetup& setup, const Front& front) {
  Eigen::AlignedBox3d blank = setup.blank;
  blank.min().z() =
      std::min(blank.min().z(), lowest_of(front, {Eigen::Vector2d(blank.min().head<2>()),
                                                  Eigen::Vector2d(blank.max().head<2>())}));
  return blank;
}

/// Explains how Z is set in the programs with the most tools.
std::string length_words_of(const PostDescription& post, const ProgramFiles& programs) {
  std::size_t most = 1;
  for (const WrittenProgram& file : programs.files)
    most = std::max(most, file.reading.tools.size());
  return length_words(post, most, "the tool of each program");
}

/// Decimals of a blank's height: nobody measures it finer.
constexpr int kHeightDecimals = 2;

/// True if the blank is cut from a sheet: one of its own, of acrylic, with a flat underside.
bool takes_sheet(const WrittenCut& cut) {
  const CutSetup& setup = cut.setup;
  const std::string& material = setup.options.workshop.material.name;
  const bool acrylic = material.find("acryl") != std::string::npos ||
                       material.find("Acryl") != std::string::npos ||
                       material.find("PMMA") != std::string::npos;
  return acrylic && !cut.shared && setup.options.part == PartKind::kLens &&
         (setup.is_front() || !setup.lens->setup.front);
}

/// How a sheet becomes as high as the blank.
std::string height_words(const CutSetup& setup, double sheet) {
  const double height = setup.blank.max().z();
  const std::string needed = mm(height, kHeightDecimals);
  if (sheet == 0.0) {
    return joined({"at least ", needed, ", more than sheets on sale have (",
                   trimmed_decimal(kSheetsOnSale.back(), 0), " mm): face a block to ", needed});
  }
  const std::string bought = trimmed_decimal(sheet, 0) + " mm";
  const std::string fit = joined({"a sheet of ", bought, ", the next on sale above ", needed});
  const double off = sheet - height;
  const std::string measure = "; measure it, sheets are up to 0.4 mm and a tenth off";
  if (off < 0.5 * std::pow(10.0, -kHeightDecimals)) return fit + measure;
  // The second setup's programs count on the blank's height, --stock on both its faces.
  if (setup.is_front()) {
    return joined({fit, ": face it off by ", mm(off, kHeightDecimals), measure});
  }
  return joined({fit, ": face its top off by ", mm(off, kHeightDecimals),
                 ", or run cam with --stock ",
                 trimmed_decimal(setup.options.workshop.stock.allowance + off, 3),
                 "mm, whose programs start from its top", measure});
}

/// A force of 1 N in the middle of a square plate that is clamped all around bends it by 0.0056 a²
/// / D (Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, table 37), D = E t³ / 12 (1
/// − ν²).
/// @param side, thickness  mm. @return µm; of acrylic.
double sag_of(double side, double thickness) {
  constexpr double kClamped = 0.0056;
  constexpr double kModulus = 3200.0;  // N/mm²
  constexpr double kPoisson = 0.37;
  const double stiffness =
      kModulus * thickness * thickness * thickness / (12.0 * (1.0 - kPoisson * kPoisson));
  return 1e3 * kClamped * side * side / stiffness;
}

/// What carries the blank in the second setup, and how stiff that is.
std::string support_words(const CutSetup& setup) {
  const OpticalSetup& optics = setup.lens->setup;
  const double frame = frame_width(setup.options, optics);
  const double span =
      optics.lens_size.maxCoeff() + 2.0 * (setup.options.workshop.stock.margin - frame);
  const double least = setup.lens->surface.vertices.row(2).minCoeff();
  return joined({"a flat frame at least ", mm(frame, 2), " wide, ",
                 mm(0.0 - setup.frame.value(), 3), " below the front's height 0, which carries ",
                 mm(span, 1), " of the lens, ", mm(least, 2), " thick or more: 1 N in its middle ",
                 "bends it by up to ", decimal_text(sag_of(span, least), 3), " µm"});
}

/// How the two setups of a lens whose faces are both cut follow each other; empty for one setup.
std::string two_setup_words(const CutSetup& setup) {
  if (!setup.frame) return "";
  const double margin = setup.options.workshop.stock.margin;
  const std::string left = decimal_text(-margin, 3);
  const std::string right = decimal_text(setup.lens->setup.lens_size.x() + margin, 3);
  const double top = setup.is_front() ? setup.back_top : setup.blank.max().z();
  const std::string high = mm(top - *setup.frame, 3);
  if (!setup.is_front()) {
    return joined({"second of two setups. The blank lies on ", support_words(setup),
                   ". Z 0 is the table under the frame, so that the lens's thickness does not ",
                   "depend on the blank's, which is ", high,
                   " before the cut. Zero X and Y on the ",
                   "edges of the first setup: that which was at the left there is at the right, X ",
                   right, ", the lower one at Y ", left});
  }
  return joined({"first of two setups. The front comes first, because the flat blank lies on its ",
                 "whole face, and its top, the frame that stays around the front, becomes what it ",
                 "lies on. Zero X and Y on the blank's left edge, X ", left,
                 ", and its lower edge, Y ", left, ", and mark both. The blank is ", high,
                 " high. Then polish the front and turn the blank over about the axis along Y: ",
                 "its left edge comes to the right, X ", right, ", its lower edge stays at Y ",
                 left, ". It lies on ", support_words(setup), ". Cut the back with lensforge cam ",
                 setup.options.job,
                 " --z-zero table and the other options as now, Z 0 on the table"});
}

/// What is touched off, and which Z it is.
std::string z_zero_words(const CutSetup& setup) {
  const double top = setup.blank.max().z() + setup.z_offset;
  if (setup.options.z_zero == ZZero::kTable) {
    return joined(
        {"touch off the face that the blank lies on: Z 0; the top of the blank is then at Z ",
         decimal_text(top, 3)});
  }
  return joined({"touch off the top of the blank, after facing: Z ", decimal_text(top, 3)});
}

SetupSheet setup_sheet(const WrittenCut& cut) {
  const CutSetup& setup = cut.setup;
  const CamOptions& options = setup.options;
  const Lens& designed = *setup.lens;
  const bool lens = options.part == PartKind::kLens;
  SetupSheet sheet;
  sheet.machine = options.workshop.machine.name;
  sheet.material = lens ? options.workshop.material.name : "mould material";
  sheet.part = setup.field.box;
  if (lens) sheet.part.min().z() = 0.0;  // The surface's box ends at its lowest point.
  sheet.blank = setup.blank;
  const Eigen::Vector2d& corner = cut.corner;
  sheet.zero = {-corner.x(), -corner.y(), -setup.z_offset};
  const char* const part = traits(designed.setup.body).name;
  sheet.zero_words = joined(
      {"lower left corner of the ", cut.shared ? "blank" : part, ", ", words_for(options.z_zero)});
  sheet.up_words = up_words(setup);
  sheet.length_words = length_words_of(options.post, cut.programs);
  sheet.z_words = z_zero_words(setup);
  if (takes_sheet(cut)) {
    sheet.sheet = thinnest_sheet(kSheetsOnSale, setup.blank.max().z());
    sheet.height_words = height_words(setup, sheet.sheet);
  }
  sheet.apron = setup.apron;
  sheet.other_words = two_setup_words(setup);
  if (setup.is_front()) {
    sheet.part.min().z() = options.workshop.stock.allowance;
  } else if (setup.frame) {
    sheet.front = designed.setup.front;
    sheet.frame = setup.frame;
    sheet.frame_width = frame_width(options, designed.setup);
  } else if (lens && designed.setup.front) {
    sheet.front = designed.setup.front;
    sheet.front_words = front_words(setup);
    sheet.blank = whole_box(setup, *designed.setup.front);
  }
  for (const KeepOut& clamp : options.workshop.keep_outs) {
    sheet.keep_outs.push_back({clamp.name, {clamp.low, clamp.high}});
  }
  return sheet;
}

/// Files that contain an operation: "finish_1.ngc, finish_2.ngc".
std::string files_of(const ProgramFiles& programs, std::size_t operation) {
  std::string names;
  for (const WrittenProgram& file : programs.files) {
    const bool holds =
        std::any_of(file.operations.begin(), file.operations.end(),
                    [&](const OperationTime& time) { return time.operation == operation; });
    if (holds) names = with_word(names, file.path.filename().string());
  }
  return names;
}

std::vector<ReportOperation> report_operations(const WrittenCut& cut) {
  const ProgramFiles& programs = cut.programs;
  std::vector<ReportOperation> operations;
  for (std::size_t i = 0; i < programs.summaries.size(); ++i) {
    const Tool& tool = cut.setup.options.workshop.tool(programs.summaries[i].tool);
    const ProgramTime& time = programs.times[i];
    operations.push_back({programs.summaries[i], files_of(programs, i), tool.feed, tool.spindle_rpm,
                          time.seconds / kSecondsPerMinute, time.lines,
                          time.peak_lines_per_second});
  }
  return operations;
}

std::vector<Tool> tools_of(const WrittenCut& cut) {
  std::vector<Tool> tools;
  for (const OperationSummary& summary : cut.programs.summaries) {
    const bool known = std::any_of(tools.begin(), tools.end(),
                                   [&](const Tool& tool) { return tool.number == summary.tool; });
    if (!known) tools.push_back(cut.setup.options.workshop.tool(summary.tool));
  }
  return tools;
}

ParameterGroup finish_parameters(const WrittenCut& cut) {
  const CutSetup& setup = cut.setup;
  const FinishProcess& finish = setup.options.workshop.process.finish;
  ParameterGroup group{
      "Finishing",
      {{"Stepover", mm(setup.pitch(), 4)},
       {"Rows along", finish.along == PassAxis::kX ? "X" : "Y"},
       {"Tolerance", mm(finish.tolerance, 5)},
       {"Slope tolerance", decimal_text(1e3 * aimed_slope(setup.options), 2) + " mrad"},
       {"Decimals", std::to_string(decimals_of(setup.options))},
       {"Surface", words_for(setup.model)}}};
  if (const RestMap* const rest = cut.passes.balls->rest()) {
    const Tool& large = *larger_ball(setup.options);
    group.parameters.push_back(
        {"Larger ball", mm(large.diameter, 2) + ", stepover " +
                            mm(finish.large_every * setup.pitch(), 4) + ", leaves " +
                            percent_text(rest->share_within(BallBlend::kWidth)) +
                            " of the lens to the smaller one, overlap included"});
  }
  if (finish.pitch_error != 0.0) {
    group.parameters.push_back(
        {"Pitch error, as assumed", decimal_text(100.0 * finish.pitch_error, 3) + " %"});
  }
  return group;
}

template <class Level>
NamedText entry_parameter(const char* name, const Level& level) {
  const std::string angle = ", at most " + decimal_text(level.ramp_angle_deg, 1) + "°";
  if (level.entry == EntryStyle::kRamp) return {name, "along the pass" + angle};
  return {name, "down a helix of radius " + mm(level.helix_radius, 2) + angle};
}

/// Parameters of the entry into material before finishing.
ParameterGroup entry_parameters(const Process& process) {
  ParameterGroup group{"Into material", {}};
  if (process.rough.enabled) group.parameters.push_back(entry_parameter("Roughing", process.rough));
  if (process.semi.enabled) {
    group.parameters.push_back(entry_parameter("Semi-finishing", process.semi));
  }
  return group;
}

/// Parameters of the outline cut.
ParameterGroup outline_parameters(const CutSetup& setup) {
  const OutlineCut cut = setup.outline_cut();
  return {
      "Outline",
      {{"Tool", "T" + std::to_string(cut.tool.number) + ", " + cut.tool.name},
       {"Tabs", cut.tabs.count == 0
                    ? "none: the lens comes free in the last turn"
                    : std::to_string(cut.tabs.count) + ", " + mm(cut.tabs.width, 2) + " wide, " +
                          mm(cut.tabs.height, 2) + " high, to be snapped by hand"}}};
}

std::string sampling_words(const CutSetup& setup) {
  const Eigen::Vector2d spacings =
      sample_spacings(setup.options, setup.lens->setup, setup.passes());
  if (spacings.x() == spacings.y()) return mm(spacings.x(), 4);
  return mm(spacings.minCoeff(), 4) + " across the passes, " + mm(spacings.maxCoeff(), 4) +
         " along";
}

ParameterGroup polish_parameters(const CutSetup& setup) {
  const CamOptions& options = setup.options;
  const PolishModel& polish = options.workshop.polish;
  const bool film = polish.order == kFilmOrder;
  ParameterGroup group{"Polishing, as assumed",
                       {{film ? "Film of order 4, σ" : "Gaussian σ", mm(polish.sigma, 3)},
                        {"Sampled every", sampling_words(setup)}}};
  if (polish.floor > 0.0) {
    group.parameters.push_back({"Left of every ripple", percent_text(polish.floor)});
  }
  if (polish.roughness > 0.0) {
    group.parameters.push_back(
        {"Roughness", joined({trimmed_decimal(polish.roughness, 2), " nm rms over ",
                              trimmed_decimal(polish.correlation, 2), " µm"})});
  }
  if (polish.rim_depth > 0.0) {
    group.parameters.push_back(
        {"Taken off at the rim", mm(options.workshop.polish.rim_depth, 4) + ", falling over " +
                                     mm(options.workshop.polish.rim_length, 2)});
  }
  return group;
}

/// None for a part that is not polished.
std::optional<PolishTask> polish_task(const CutSetup& setup) {
  const PolishModel& polish = setup.options.workshop.polish;
  if (!(polish.sigma > 0.0)) return std::nullopt;
  const double pitch = setup.pitch();
  const double scallop = pitch * pitch / (8.0 * finishing_ball(setup.options).radius());
  return PolishTask{polish, pitch, scallop, setup.lens->setup.lens_size.prod()};
}

/// Parts that tell the range to a tenth, and take a minute or two.
constexpr std::string_view kSpreadParts = "50";

/// The command that predicts how much parts differ, for those that --tolerances takes.
std::string tolerance_hint(const CutSetup& cut, bool shared) {
  const CamOptions& options = cut.options;
  const OpticalSetup& setup = cut.lens->setup;
  if (options.tolerances > 0 || !tolerance_fault(options, setup).empty()) return "";
  return joined({"lensforge ", shared ? std::string("nest") : "cam " + options.job,
                 " --tolerances ", kSpreadParts});
}

/// The certificates of all finishing operations in one.
PathCertificate whole_certificate(const ProgramFiles& programs) {
  PathCertificate whole;
  const auto take = [](Extreme& to, const Extreme& from) {
    if (from.value > to.value) to = from;
  };
  for (const OperationSummary& summary : programs.summaries) {
    if (!summary.certified || summary.allowance > 0.0) continue;
    take(whole.gouge, summary.certificate.gouge);
    take(whole.excess, summary.certificate.excess);
    take(whole.slope, summary.certificate.slope);
  }
  return whole;
}

CutFindings findings_of(const ProgramFiles& programs, const std::optional<Prediction>& prediction) {
  const PathCertificate certificate = whole_certificate(programs);
  CutFindings findings;
  findings.gouge = certificate.gouge.value;
  findings.excess = certificate.excess.value;
  findings.slope = certificate.slope.value;
  findings.block_rate = programs.total.peak_lines_per_second;
  if (!prediction) return findings;
  const PictureQuality& part = prediction->judged().part().quality;
  findings.leakage = part.leakage;
  findings.dark_flux = part.dark_flux;
  findings.mae_increase =
      std::max(0.0, part.metrics.mae - prediction->judged().designed.quality.metrics.mae);
  findings.fillet_depth =
      prediction->creases.worst.empty() ? 0.0 : prediction->creases.worst[0].depth;
  return findings;
}

ReportMap fillet_map(const CreaseMap& creases) {
  ReportMap map{"Material left in creases",
                "What the ball cannot reach, the most in every square.",
                "µm",
                {static_cast<int>(creases.columns), static_cast<int>(creases.rows), {}}};
  for (const float depth : creases.depth) {
    map.raster.values.push_back(static_cast<float>(kMicrometres) * depth);
  }
  return map;
}

ReportMap fillet_share_map(const CreaseMap& creases) {
  ReportMap map{"Light concerned by creases",
                "Share of every square that is fillet instead of the designed surface.",
                "%",
                {static_cast<int>(creases.columns), static_cast<int>(creases.rows), {}}};
  for (const float share : creases.share) map.raster.values.push_back(100.0F * share);
  return map;
}

/// Difference of the index of the workshop's material from the design's; 0 where it states none,
/// and for a mould or a mirror, through whose material no light passes.
double index_error(const CutSetup& setup) {
  const double stated = setup.options.workshop.material.ior;
  const bool lit =
      setup.options.part == PartKind::kLens && traits(setup.lens->setup.body).transmits;
  if (!(stated > 0.0) || !lit) return 0.0;
  return std::abs(stated - setup.lens->setup.ior);
}

/// Explains why tools touch the blank without roughing; empty if the first one's flutes are long
/// enough. Roughing by other programs is unknown: the blank counts as whole.
std::string unroughed_warning(const WrittenCut& cut) {
  const Workshop& workshop = cut.setup.options.workshop;
  if (workshop.process.rough.enabled || cut.programs.summaries.empty()) return "";
  const OperationSummary& first = cut.programs.summaries.front();
  const Tool& tool = workshop.tool(first.tool);
  const double depth = cut.setup.blank.max().z() - first.tip.min().z();
  if (depth <= tool.flute_length) return "";
  return joined({"nothing is roughed: '", first.name, "' cuts ", decimal_text(depth, 1),
                 " mm deep into the whole blank, tool ", std::to_string(tool.number), " has ",
                 decimal_text(tool.flute_length, 1),
                 " mm of flutes; run a roughing program first, or use a tool with longer flutes"});
}

/// Explains why the part's picture would differ from the designed one; empty if it does not.
std::string index_warning(const CutSetup& setup) {
  const double stated = setup.options.workshop.material.ior;
  if (!(index_error(setup) > kIndexTolerance)) return "";
  return joined({"the workshop's material has index ", trimmed_decimal(stated, 4),
                 ", the lens was designed for ", trimmed_decimal(setup.lens->setup.ior, 4),
                 ": it would project another picture"});
}

/// Intended process of the lens if it differs from the actual one; else, or if unknown, empty.
std::string process_warning(const CutSetup& setup) {
  const nlohmann::json& provenance = setup.lens->provenance.json();
  if (!provenance.is_object() || !provenance.contains("made_by")) return "";
  const nlohmann::json& meant = provenance["made_by"];
  const Workshop& shop = setup.options.workshop;
  const auto number = [&](const char* key, double otherwise) {
    const bool known = meant.is_object() && meant.contains(key) && meant[key].is_number();
    return known ? meant[key].get<double>() : otherwise;
  };
  const FinishProcess& finish = shop.process.finish;
  // A cast is smaller than its mould, and is polished after casting.
  const double scale = setup.options.part == PartKind::kMould ? 1.0 - setup.options.shrinkage : 1.0;
  const double radius = finishing_ball(setup.options).radius();
  const double pitch = scale * max_pitch(finish, radius, setup.field.steepest);
  const double sigma = shop.polish.sigma;
  const double meant_pitch = number("pitch_mm", pitch);
  const double meant_sigma = number("polish_sigma_mm", sigma);
  const bool other_pitch = std::abs(meant_pitch - pitch) > kSamePitch * meant_pitch;
  // Without these keys a design knows order 2 without a floor.
  const double meant_order = number("polish_order", kPadOrder);
  const double meant_floor = number("polish_floor", 0.0);
  const bool other_kind = meant_order != shop.polish.order || meant_floor != shop.polish.floor;
  if (!other_pitch && !other_kind && meant_sigma == sigma) return "";
  // A design for a scallop does not know its slopes: designed again, it would assume the same.
  const std::string advice =
      other_pitch && finish.scallop > 0.0
          ? "cut it with --pitch " + trimmed_decimal(meant_pitch / scale, 4) + "mm"
          : "cut it as it was designed, or design it for this workshop (--made-by)";
  const auto kind = [&](double order, double floor) {
    return other_kind ? joined({" (order ", trimmed_decimal(order, 0), ", floor ",
                                trimmed_decimal(floor, 4), ")"})
                      : std::string();
  };
  return joined({"the lens was designed for a pitch of ", trimmed_decimal(meant_pitch, 4),
                 " mm and a polish of σ ", trimmed_decimal(meant_sigma, 4), " mm",
                 kind(meant_order, meant_floor), ", not ", trimmed_decimal(pitch, 4), " and ",
                 trimmed_decimal(sigma, 4), " mm", kind(shop.polish.order, shop.polish.floor), ": ",
                 advice});
}

/// Warns of a speed that the controller's setting would silently lower; empty without such a
/// setting.
std::string spindle_warning(const WrittenCut& cut) {
  const int setting = cut.setup.options.post.reader.spindle_limit_setting;
  if (setting == 0) return {};
  double fastest = 0.0;
  for (const Tool& tool : tools_of(cut)) fastest = std::max(fastest, tool.spindle_rpm);
  return "the controller runs the spindle no faster than its setting $" + std::to_string(setting) +
         ", silently: set it to at least " + decimal_text(fastest, 0);
}

/// Light enters a curved front beyond the lens's edges.
std::string margin_warning(const CutSetup& setup) {
  const double margin = setup.options.workshop.stock.margin;
  const double needed = overhang(setup.lens->surface, setup.lens->setup);
  if (setup.options.part != PartKind::kLens) return {};
  const std::string lit = joined(
      {"light enters the front up to ", mm(needed, 2), " beyond the lens's edges, but the "});
  if (setup.frame) {
    if (!(needed > setup.apron)) return {};
    return joined(
        {lit, "front is cut ", mm(setup.apron, 2), " beyond them: the picture's rim stays dark"});
  }
  if (!(needed > margin)) return {};
  return joined({lit, "blank ends at ", mm(margin, 2),
                 ": the picture's rim stays dark unless stock.margin is at least ",
                 mm(std::ceil(10.0 * needed) / 10.0, 1)});
}

std::vector<std::string> warnings_of(const WrittenCut& cut) {
  const CutSetup& setup = cut.setup;
  const ProgramTime& total = cut.programs.total;
  std::vector<std::string> warnings;
  const std::string unroughed = unroughed_warning(cut);
  if (!unroughed.empty()) warnings.push_back(unroughed);
  const std::vector<std::string> safety = safety_warnings(cut);
  warnings.insert(warnings.end(), safety.begin(), safety.end());
  for (const std::string& sentence : {index_warning(setup), margin_warning(setup),
                                      process_warning(setup), decimals_warning(setup.options)}) {
    if (!sentence.empty()) warnings.push_back(sentence);
  }
  const Eigen::Vector3d travel = setup.options.workshop.machine.travel;
  if ((setup.blank.sizes().array() > travel.array()).any()) {
    warnings.push_back("the blank is larger than the machine's travel of " +
                       decimal_text(travel.x(), 0) + " x " + decimal_text(travel.y(), 0) + " x " +
                       decimal_text(travel.z(), 0) + " mm");
  }
  const HeightField& field = setup.field;
  if (field.steepest > kSteepestSlope) {
    warnings.push_back("the surface rises by " + decimal_text(field.steepest, 2) +
                       " mm a millimetre at x " + decimal_text(field.steepest_place.x(), 2) +
                       " y " + decimal_text(field.steepest_place.y(), 2) +
                       ": on slopes above 1 a rim may be left uncut");
  }
  const std::string spindle = spindle_warning(cut);
  if (!spindle.empty()) warnings.push_back(spindle);
  if (total.starved > 0) {
    warnings.push_back(
        "the controller will wait for lines " + std::to_string(total.starved) + " times at " +
        decimal_text(setup.options.workshop.machine.lines_per_second, 0) +
        " lines/s: the cut then takes " +
        decimal_text(total.stream_limited_seconds / kSecondsPerMinute, 0) + " minutes");
  }
  return warnings;
}

/// Checks of what the machine must not do, and of what must not be machined.
std::vector<LimitCheck> all_safety_checks(const WrittenCut& cut) {
  std::vector<LimitCheck> checks = safety_checks(cut);
  if (cut.setup.options.workshop.material.ior > 0.0) {
    checks.push_back({"material_ior", "material's refractive index off the design's",
                      index_error(cut.setup), kIndexTolerance, "", 4});
  }
  return checks;
}

/// Safety first. A controller without a line limit takes any load.
Verdict whole_verdict(const WrittenCut& cut, const std::optional<Prediction>& prediction) {
  const CamOptions& options = cut.setup.options;
  CutLimits limits = options.limits;
  limits.block_rate = options.workshop.machine.lines_per_second;
  CutFindings findings = findings_of(cut.programs, prediction);
  if (!(limits.block_rate > 0.0)) findings.block_rate.reset();
  Verdict verdict = judge_cut(findings, limits, options.stated_limits);
  const std::vector<LimitCheck> safety = all_safety_checks(cut);
  verdict.checks.insert(verdict.checks.begin(), safety.begin(), safety.end());
  return verdict;
}

/// Which faces of a lens of two shaped ones the pictures show as made; empty for a back that is cut
/// into a blank with its front.
std::string face_words(const CutSetup& setup, const Prediction& prediction) {
  const std::vector<RenderedSurface>& others = prediction.leakage.others;
  const bool both = std::any_of(others.begin(), others.end(), [](const RenderedSurface& one) {
    return one.name == surface_name::kBoth;
  });
  if (!both && !setup.frame) return "";
  const char* const other = setup.is_front() ? "back" : "front";
  const std::string words =
      joined({"The pictures show this face as cut and polished and the ", other, " as designed"});
  if (both) return joined({words, "; “", surface_name::kBoth, "” shows both as made."});
  return joined({words, ": cut the ", other, ", too, and this again, for the picture of both."});
}

void add_prediction(const Prediction& prediction, const Lens& lens, ReportData& data) {
  data.target = lens.target;
  data.leakage = prediction.leakage;
  data.waves = prediction.waves;
  data.light_words = prediction.light_words;
  data.blurs = prediction.blurs;
  if (const Haze& haze = prediction.haze; !haze.none()) {
    data.haze =
        ReportHaze{haze.share, haze.width(), haze.roughness.rms, haze.roughness.correlation};
  }
  data.haze_words = prediction.haze_words;
  data.second = prediction.second;
  if (traits(data.body).transmits) data.ghost = ghost_share(lens.setup.ior);
  data.sampling = prediction.sampling;
  data.shown = {{surface_name::kDesigned, "what is meant"},
                {surface_name::kRounded, "the most that the ball can reach"},
                {surface_name::kMilled, "before polishing: its ridges scatter light"},
                {surface_name::kPolished, "the finished part"},
                {surface_name::kBoth, "both as cut and polished"}};
  data.places = prediction.places;
  data.tolerances = prediction.tolerances;
  data.faces = prediction.faces;
  data.surface = prediction.surface;
  data.maps = {prediction.height, fillet_map(prediction.creases),
               fillet_share_map(prediction.creases)};
}

}  // namespace

ReportData make_report(const WrittenCut& cut, const std::optional<Prediction>& prediction) {
  const CutSetup& setup = cut.setup;
  const CamOptions& options = setup.options;
  const Lens& lens = *setup.lens;
  ReportData data;
  data.job = options.job;
  data.program = program_mark();
  data.lens_id = fingerprint_of(lens);
  data.body = lens.setup.body;
  data.part = options.part == PartKind::kMould ? "mould" : traits(data.body).name;
  data.front = setup.is_front();
  data.lens_size = lens.setup.lens_size;
  data.leakage_options = options.leakage;
  data.operations = report_operations(cut);
  data.tools = tools_of(cut);
  data.parameters = {finish_parameters(cut)};
  const Process& process = options.workshop.process;
  if (process.rough.enabled || process.semi.enabled) {
    data.parameters.push_back(entry_parameters(process));
  }
  if (setup.cuts_outline()) data.parameters.push_back(outline_parameters(setup));
  data.setup = setup_sheet(cut);
  data.light = lens.setup;
  data.light_height = lens.surface.vertices.row(2).maxCoeff();
  data.z_offset = setup.z_offset;
  data.warnings = warnings_of(cut);
  data.path = cut.record.shown_path();
  if (prediction) {
    data.parameters.push_back(polish_parameters(setup));
    data.polish = polish_task(setup);
    data.tolerance_hint = tolerance_hint(setup, cut.shared);
    add_prediction(*prediction, lens, data);
    data.face_words = face_words(setup, *prediction);
  }
  data.verdict = whole_verdict(cut, prediction);
  return data;
}

}  // namespace lensforge
