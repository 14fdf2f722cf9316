// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>
#include <string_view>

#include "cam/workshop/workshop.h"
#include "core/optics/polish_transfer.h"
#include "core/schema/toml.h"

namespace lensforge {
namespace {

constexpr double kLength = 10000.0;    ///< mm; longer than any mill.
constexpr double kBlank = 1000.0;      ///< mm by which a blank may exceed its lens, or length of a
                                       ///< tool.
constexpr double kMinLength = 1e-6;    ///< mm; the last decimal of a program.
constexpr double kMinDiameter = 0.01;  ///< mm; a third of the smallest that is sold.
constexpr double kFinestStep = 1e-3;   ///< mm; of passes that only take material away.
constexpr double kMinRate = 0.1;       ///< mm/min, mm/s²; slower than any mill.
constexpr double kRate = 1e6;          ///< mm/min, mm/s², rpm.
constexpr double kSpin = 1e6;          ///< rpm
/// mm; four units of the last decimal of any dialect, of which rounding takes one.
constexpr double kFinestTolerance = 4e-6;
/// rad; rounding to that decimal turns a move of 0.1 mm by as much.
constexpr double kFinestSlope = 1e-5;
/// mm; of a circle down which a tool winds: below it the turns are too many to write.
constexpr double kMinHelix = 0.01;
/// mm of feed through air above material: less than a twist of a chuck's jaws.
constexpr double kMinClearance = 0.05;

/// Share of a length; a controller with such a wrong number of steps per millimetre shows at once.
constexpr double kMaxPitchError = 0.02;

/// σ and depth at the rim, mm; beyond it no picture is left.
constexpr double kMaxPolish = 1.0;

/// Share of a ripple that stays; with more there is hardly a polish.
constexpr double kMaxFloor = 0.99;

/// nm, beyond which no light is left that is not scattered; and µm, beyond which it stays in its
/// pixel.
constexpr double kMaxRoughness = 1000.0;
constexpr double kMaxCorrelation = 1000.0;

/// mm; of pixels and layers: below the finest that are sold, and above the coarsest.
constexpr double kFinestPrint = 1e-3;
constexpr double kCoarsestPrint = 1.0;
/// mm; of a film's σ: with less no step is levelled, with more no picture is left.
constexpr double kLeastFilm = 0.01;
constexpr double kMostFilm = 5.0;

/// mm; shorter waves are finer than the rows.
constexpr double kShortestWave = 0.2;
/// µm; beyond it errors are no longer small against the ball.
constexpr double kMaxError = 100.0;
/// Shares of σ; three times as much would leave none of it.
constexpr double kMaxPolishSpread = 0.3;

const Choices<CutterShape> kShapes{
    {"ball", CutterShape::kBall}, {"bull", CutterShape::kBull}, {"flat", CutterShape::kFlat}};
const Choices<PassAxis> kAxes{{"x", PassAxis::kX}, {"y", PassAxis::kY}};
const Choices<PassStyle> kStyles{{"zigzag", PassStyle::kZigzag},
                                 {"climb", PassStyle::kClimb},
                                 {"conventional", PassStyle::kConventional}};
const Choices<EntryStyle> kEntries{{"ramp", EntryStyle::kRamp}, {"helix", EntryStyle::kHelix}};

void describe_axes(Description& d, const std::string& key, Eigen::Vector3d& value,
                   const Limits& limits, const char* unit, const char* help) {
  const char* const axes[] = {"_x", "_y", "_z"};
  for (int axis = 0; axis < 3; ++axis) {
    d.number(key + axes[axis], value[axis], limits, unit, axis == 0 ? help : "");
  }
}

template <class Level>
void describe_following(Description& d, Level& process) {
  d.length("stepover", process.stepover, {kFinestStep, 100.0}, "mm between passes at most");
  d.length("allowance", process.allowance, {0.0, 100.0}, "mm left on the surface");
  d.number("ramp_angle_deg", process.ramp_angle_deg, {0.1, 45.0}, "degrees",
           "steepest way into material");
  d.word("entry", process.entry, kEntries, "ramp along the pass, or helix where one fits");
  d.length("helix_radius", process.helix_radius, {kMinHelix, 50.0},
           "mm, of the tool's axis; half its diameter at most");
  d.length("spacing", process.spacing, {0.001, 10.0},
           "mm between points at which the surface is evaluated");
  d.word("style", process.style, kStyles, "zigzag, climb or conventional");
  d.word("along", process.along, kAxes, "x or y");
}

}  // namespace

void describe(Description& d, Machine& machine) {
  d.text("name", machine.name, "",
         "the paper's mill (Sun et al., Section 5); its limits below are "
         "assumed: put in your own");
  d.text("post", machine.post, "",
         "dialect of its controller: linuxcnc, grbl, grblhal, fanuc, weihong, or a description "
         "beside this file, mine.toml");
  describe_axes(d, "travel", machine.travel, {kMinRate, kLength}, "mm", "mm");
  d.number("spindle_min_rpm", machine.spindle_min_rpm, {0.0, kSpin}, "rpm", "");
  d.number("spindle_max_rpm", machine.spindle_max_rpm, {1.0, kSpin}, "rpm",
           "the paper cuts at 23000");
  d.flag("spindle_by_hand", machine.spindle_by_hand,
         "a router that the operator switches: programs pause for it, without M3");
  describe_axes(d, "max_rate", machine.max_rate, {kMinRate, kRate}, "mm/min",
                "mm/min, rapids and feeds");
  describe_axes(d, "acceleration", machine.acceleration, {kMinRate, kRate}, "mm/s^2", "mm/s^2");
  d.length("junction_deviation", machine.junction_deviation, {0.0, 1.0},
           "mm that a corner may be rounded");
  d.length("arc_tolerance", machine.arc_tolerance, {kMinLength, 1.0},
           "mm, of arcs as the controller splits them");
  describe_axes(d, "steps_per_mm", machine.steps_per_mm, {0.0, kRate}, "",
                "0: do not round to steps");
  d.whole("look_ahead", machine.look_ahead, {2, 100000}, "moves planned ahead");
  d.number(
      "lines_per_second", machine.lines_per_second, {0.0, kRate}, "lines/s",
      "maximum that the controller accepts, lines/s; 0: no limit; an 8-bit Grbl board takes 400");
}

void describe(Description& d, Material& material) {
  d.text("name", material.name, "", "");
  d.number("ior", material.ior, {1.000001, 5.0}, "",
           "refractive index, checked against the lens's (Sun et al., Section 5: 1.49)")
      .zero_if_missing = true;
}

void describe(Description& d, Stock& stock) {
  d.length("margin", stock.margin, {0.0, kBlank},
           "mm beyond the lens's rectangle on every side, at least a finishing ball's radius and 8 "
           "sigma, 16 where polish.order is 4");
  d.length("allowance", stock.allowance, {0.0, kBlank}, "mm above the surface's highest point");
}

void describe(Description& d, KeepOut& box) {
  d.text("name", box.name, "", "");
  describe_axes(d, "low", box.low, {-kLength, kLength}, "mm", "mm, lens frame");
  describe_axes(d, "high", box.high, {-kLength, kLength}, "mm", "");
}

void describe(Description& d, ToolSection& section) {
  d.length("diameter", section.diameter, {kMinLength, kBlank}, "mm").needed = true;
  d.length("from", section.from, {0.0, kBlank}, "mm above the tip").needed = true;
  d.length("to", section.to, {kMinLength, kBlank}, "mm above the tip").needed = true;
}

void describe(Description& d, Tool& tool) {
  d.whole("number", tool.number, {1, 9999}, "T word");
  d.text("name", tool.name, "", "");
  d.word("shape", tool.shape, kShapes, "ball, bull or flat");
  d.length("diameter", tool.diameter, {kMinDiameter, 100.0}, "mm").needed = true;
  d.length("corner_radius", tool.corner_radius, {0.0, 50.0}, "mm, of a bull");
  d.whole("teeth", tool.teeth, {1, 100}, "for the report");
  d.length("flute_length", tool.flute_length, {kMinLength, kBlank},
           "mm above the tip that cut; above it nothing may touch material")
      .needed = true;
  d.number("spindle_rpm", tool.spindle_rpm, {1.0, kSpin}, "rpm", "");
  d.number("feed", tool.feed, {kMinRate, kRate}, "mm/min", "mm/min").needed = true;
  d.number("plunge", tool.plunge, {kMinRate, kRate}, "mm/min", "mm/min into material").needed =
      true;
  d.list("section", tool.sections, "Cylinders above the flutes, from below: neck, shank, holder.");
}

void describe(Description& d, RoughProcess& rough) {
  d.flag("enabled", rough.enabled, "");
  d.whole("tool", rough.tool, {1, 9999}, "number");
  d.length("stepdown", rough.stepdown, {kFinestStep, 100.0}, "mm between levels at most");
  describe_following(d, rough);
}

void describe(Description& d, SemiProcess& semi) {
  d.flag("enabled", semi.enabled, "");
  d.whole("tool", semi.tool, {1, 9999}, "number");
  describe_following(d, semi);
}

void describe(Description& d, FinishProcess& finish) {
  d.whole("tool", finish.tool, {1, 9999}, "number, of a ball");
  d.length("pitch", finish.pitch, {kMinLength, 100.0},
           "mm between passes at most (Sun et al., Section 5: 0.06)");
  d.length("scallop", finish.scallop, {0.0, 10.0}, "mm; above 0 the pitch follows from it");
  d.length("tolerance", finish.tolerance, {kFinestTolerance, 1.0}, "mm from the exact path");
  d.number("slope_tolerance", finish.slope_tolerance, {kFinestSlope, 1.0}, "rad",
           "rad from the exact path's direction");
  d.word("style", finish.style, kStyles, "zigzag, climb or conventional");
  d.word("along", finish.along, kAxes, "x or y");
  d.number("pitch_error", finish.pitch_error, {-kMaxPitchError, kMaxPitchError}, "",
           "share of a length that the machine goes too far across the passes; the predicted part "
           "has it, programs are not changed");
  d.flag("cross", finish.cross, "a second raster along the other axis");
  d.flag("pencil", finish.pencil, "a pass along concave creases");
  d.whole("large_tool", finish.large_tool, {0, 9999},
          "number of a larger ball that finishes wherever it reaches; 0: none");
  d.whole("large_every", finish.large_every, {1, 100},
          "rows of the finishing tool per row of the larger ball");
}

/// The rest of Process: its own keys.
void describe(Description& d, Process& process) {
  d.length("safe_height", process.safe_height, {kMinSafeHeight, kBlank},
           "mm of rapids above blank and clamps");
  d.length("clearance", process.clearance, {kMinClearance, 100.0},
           "mm from clamps, and above material where the feed begins");
}

void describe(Description& d, PolishModel& polish) {
  d.length("sigma", polish.sigma, {0.0, kMaxPolish},
           "mm; of a ripple of wave number k floor + (1 - floor) exp(-(sigma k / sqrt 2)^order) "
           "stays; 0: not polished");
  d.whole("order", polish.order, {kPadOrder, kFilmOrder},
          "2: pads and wheels, an average with a Gaussian of sigma; 4: a levelling film, flame and "
          "vapour");
  d.number("floor", polish.floor, {0.0, kMaxFloor}, "",
           "share of every ripple that stays, as pads bridge valleys");
  d.number("roughness", polish.roughness, {0.0, kMaxRoughness}, "nm",
           "nm, rms, of what is finer than the ripples and scatters light; 0: not known, haze is "
           "not counted");
  d.number("correlation", polish.correlation, Limits::above(0.0, kMaxCorrelation), "µm",
           "µm, correlation length of the roughness, to 1/e");
  d.length("rim_depth", polish.rim_depth, {0.0, kMaxPolish}, "mm taken off in addition at the rim");
  d.length("rim_length", polish.rim_length, {1e-3, 1000.0},
           "mm from the rim over which that falls to a third");
}

void describe(Description& d, WavinessBand& band) {
  d.length("wavelength", band.wavelength, {kShortestWave, kLength}, "mm, middle of the band")
      .needed = true;
  d.number("rms_um", band.rms_um, {0.0, kMaxError}, "µm",
           "µm, root mean square, of the X and Y axes each")
      .needed = true;
}

void describe(Description& d, Tolerances& t) {
  d.number("row_um", t.row_um, {0.0, kMaxError}, "µm",
           "µm, height of a row against the next, sigma");
  d.length("row_length", t.row_length, {kShortestWave, kLength}, "mm over which that changes");
  d.number("backlash_um", t.backlash_um, {0.0, kMaxError}, "µm",
           "µm, of the axis along the rows, 0 to this");
  d.number("radius_um", t.radius_um, {0.0, kMaxError}, "µm",
           "µm, radius of the finishing ball, +- this");
  d.number("runout_um", t.runout_um, {0.0, kMaxError}, "µm", "µm, total indicated, 0 to this");
  d.number("polish_sigma", t.polish_sigma, {0.0, kMaxPolishSpread}, "",
           "share of the polish's sigma, from part to part, sigma");
  d.number("polish_within", t.polish_within, {0.0, kMaxPolishSpread}, "", "the same over one part");
  d.number("roughness", t.roughness, {0.0, kMaxPolishSpread}, "",
           "share of the polish's roughness, from part to part, sigma");
  d.number("index", t.index, {0.0, 0.1}, "", "refractive index, +- this");
  d.length("distance", t.distance, {0.0, kBlank}, "mm, distance of the screen, +- this");
  d.number("tilt_deg", t.tilt_deg, {0.0, 10.0}, "degrees",
           "degrees, of the part about x and about y, sigma");
  d.number("source_mrad", t.source_mrad, {0.0, 20.0}, "mrad",
           "mrad, full angle of the source seen from the lens, 0 to this; the sun has 9.3");
  d.number("temperature_k", t.temperature_k, {0.0, 100.0}, "K", "K, of the part, +- this");
  d.number("expansion_per_k", t.expansion_per_k, {0.0, 1e-3}, "", "share of a length");
  d.number("index_per_k", t.index_per_k, {-1e-3, 1e-3}, "", "of the refractive index");
  d.length("face_shift", t.face_shift, {0.0, 1.0},
           "mm, of the front against the back where both are cut, along x and along y, +- this");
  d.number("face_turn_deg", t.face_turn_deg, {0.0, 10.0}, "degrees",
           "degrees, the same about z, +- this");
  d.number("face_tilt_deg", t.face_tilt_deg, {0.0, 10.0}, "degrees",
           "degrees, the same about x and about y, +- this");
  d.length("face_thickness", t.face_thickness, {0.0, 1.0},
           "mm, thickness between both faces, +- this");
  d.list("waviness", t.waviness,
         "Waves that the machine's axes leave in the surface; rms_um = 0 for none.");
}

void describe(Description& d, Printer& printer) {
  d.text("name", printer.name, "", "");
  d.length("pixel", printer.pixel, {kFinestPrint, kCoarsestPrint},
           "mm, side of a pixel on the bed");
  d.length("layer", printer.layer, {kFinestPrint, kCoarsestPrint}, "mm, thickness of a layer");
  describe_axes(d, "bed", printer.bed, {1.0, kLength}, "mm", "mm, the largest part");
  d.flag("upright", printer.upright,
         "the lens stands on its lower edge; else its entry face lies on the bed");
  d.number("seconds_per_layer", printer.seconds_per_layer, {0.01, 3600.0}, "s",
           "s, exposure, lift and settling");
  d.number("start_minutes", printer.start_minutes, {0.0, 600.0}, "min", "min, of the first layers");
  d.length("film_sigma", printer.film_sigma, {kLeastFilm, kMostFilm},
           "mm, of the film that levels the steps, as polish.sigma; assumed");
  d.whole("film_order", printer.film_order, {kPadOrder, kFilmOrder},
          "as polish.order: 4 for resin that levels under its tension");
}

void describe(Description& d, Workshop& shop) {
  d.table("machine", shop.machine, "The mill. Sizes are millimetres.");
  d.table("material", shop.material, "What the blank is made of.");
  d.table("stock", shop.stock, "The blank before the first cut; its flat entry face is z = 0.");
  d.list("keep_out", shop.keep_outs,
         "Boxes that no part of the tool may enter, in the lens's coordinates.");
  d.list(
      "tool", shop.tools,
      "Diameters, reach and feeds are examples of what makers offer for acrylic, 0.02 to 0.03 mm "
      "a tooth\n# (0.011 mm for the ball of 0.4 mm, which with 23000 rpm is the paper's).");
  d.table("process", shop.process, "");
  d.table("rough", shop.process.rough,
          "Level by level: a third of the tool's diameter deep, two fifths wide.");
  d.table("semi", shop.process.semi,
          "Evens out what roughing leaves, so that the finishing ball has little to cut.");
  d.table("finish", shop.process.finish, "The raster that makes the optical surface.");
  d.table("polish", shop.polish,
          "What polishing does to it. More σ blurs the picture, less leaves scallops.");
  d.table(
      "tolerances", shop.tolerances,
      "How far all this may be off, for cam --tolerances. \"sigma\" is a standard deviation, other "
      "bounds are uniform.");
  d.table("printer", shop.printer,
          "A resin printer in place of the mill, for --part print; an example of what is sold.");
}

Limits workshop_limits(std::string_view key) { return description_of(Workshop()).at(key).limits; }

void validate_ranges(const Workshop& workshop, const std::string& file) {
  require_toml_limits(description_of(workshop), file);
}

Workshop parse_workshop(std::string_view text, const std::string& file) {
  Workshop shop;
  read_toml(description_of(shop), TomlFields(text, {file, "a workshop"}));
  validate(shop, file);
  return shop;
}

Workshop read_workshop(const std::filesystem::path& path) {
  return parse_workshop(read_toml_file(path, "a workshop"), path.string());
}

std::string workshop_toml(const Workshop& workshop) {
  return "# A workshop of lensforge cam: machine, blank, clamps, tools and process.\n" +
         toml_text(description_of(workshop));
}

}  // namespace lensforge
