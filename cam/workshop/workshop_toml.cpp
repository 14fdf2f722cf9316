// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cam/workshop/workshop.h"
#include "core/error.h"
#include "core/text/number_text.h"
#include "core/text/toml_fields.h"

// Each describe() below lists the keys of one table once, for the reader and the writer: key,
// range, member, and the writer's comment.
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

/// mm; shorter waves are finer than the rows.
constexpr double kShortestWave = 0.2;
/// µm; beyond it errors are no longer small against the ball.
constexpr double kMaxError = 100.0;
/// Shares of σ; three times as much would leave none of it.
constexpr double kMaxPolishSpread = 0.3;

/// A word for each value of an enumeration, in its order.
using Words = std::initializer_list<std::string_view>;
const Words kShapes = {"ball", "bull", "flat"};
const Words kAxes = {"x", "y"};
const Words kStyles = {"zigzag", "climb", "conventional"};
const Words kEntries = {"ramp", "helix"};
const Words& words_of(CutterShape /*any*/) { return kShapes; }
const Words& words_of(PassAxis /*any*/) { return kAxes; }
const Words& words_of(PassStyle /*any*/) { return kStyles; }
const Words& words_of(EntryStyle /*any*/) { return kEntries; }

template <class Enum>
std::string word_for(Enum value) {
  return std::string(words_of(value).begin()[static_cast<std::size_t>(value)]);
}

/// Reads values from a table; a missing key keeps its value.
class Reader {
 public:
  explicit Reader(TomlFields fields) : fields_(std::move(fields)) {}

  void text(const std::string& key, std::string& value, const char* /*says*/) {
    value = fields_.text_or(key, value);
  }
  void number(const NumberRule& rule, double& value, const char* /*says*/) {
    value = fields_.number_or(rule, value);
  }
  void needed(const NumberRule& rule, double& value, const char* /*says*/) {
    value = fields_.number(rule);
  }
  /// An optional number, 0 if missing.
  void stated(const NumberRule& rule, double& value, const char* says) {
    number(rule, value, says);
  }
  void whole(const NumberRule& rule, int& value, const char* /*says*/) {
    value = fields_.whole_or(rule, value);
  }
  void flag(const std::string& key, bool& value, const char* /*says*/) {
    value = fields_.flag_or(key, value);
  }
  template <class Enum>
  void word(const std::string& key, Enum& value, const char* /*says*/) {
    const Words& words = words_of(value);
    const std::string chosen = fields_.has(key) ? fields_.one_of(key, words) : word_for(value);
    value = static_cast<Enum>(std::find(words.begin(), words.end(), chosen) - words.begin());
  }
  /// An array of tables; `list` stays as it is if there is none.
  template <class Item>
  void list(const std::string& key, std::vector<Item>& list, const char* /*says*/) {
    if (!fields_.has(key)) return;
    list.clear();
    for (TomlFields& fields : fields_.tables(key)) {
      Reader reader(std::move(fields));
      describe(reader, list.emplace_back());
      reader.finish();
    }
  }
  template <class Item>
  void table(const std::string& key, Item& item, const char* /*says*/) {
    if (!fields_.has(key)) return;
    Reader reader(fields_.table(key));
    describe(reader, item);
    reader.finish();
  }
  void finish() const { fields_.finish(); }

 private:
  TomlFields fields_;
};

std::string quoted(const std::string& value) {
  std::string text = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  return text + "\"";
}

/// Writes keys, each followed by its comment.
class Writer {
 public:
  explicit Writer(std::string prefix = {}) : prefix_(std::move(prefix)) {}

  void text(const std::string& key, const std::string& value, const char* says) {
    line(key, quoted(value), says);
  }
  void number(const NumberRule& rule, double value, const char* says) {
    line(rule.key, shortest_text(value), says);
  }
  void needed(const NumberRule& rule, double value, const char* says) { number(rule, value, says); }
  void stated(const NumberRule& rule, double value, const char* says) {
    if (value > 0.0) return number(rule, value, says);
    text_ += "# " + rule.key + " =  # " + says + "\n";
  }
  void whole(const NumberRule& rule, int value, const char* says) {
    line(rule.key, std::to_string(value), says);
  }
  void flag(const std::string& key, bool value, const char* says) {
    line(key, value ? "true" : "false", says);
  }
  template <class Enum>
  void word(const std::string& key, Enum value, const char* says) {
    line(key, quoted(word_for(value)), says);
  }
  template <class Item>
  void list(const std::string& key, std::vector<Item>& list, const char* says) {
    const char* introduction = says;
    for (Item& item : list) {
      header("[[" + prefix_ + key + "]]", introduction, key, item);
      introduction = "";
    }
  }
  template <class Item>
  void table(const std::string& key, Item& item, const char* says) {
    header("[" + prefix_ + key + "]", says, key, item);
  }
  [[nodiscard]] const std::string& result() const { return text_; }

 private:
  template <class Item>
  void header(const std::string& name, const std::string& says, const std::string& key,
              Item& item) {
    Writer inner(prefix_ + key + ".");
    describe(inner, item);
    text_ += "\n" + (says.empty() ? says : "# " + says + "\n") + name + "\n" + inner.result();
  }
  void line(const std::string& key, const std::string& value, const std::string& says) {
    text_ += key + " = " + value;
    if (!says.empty()) text_ += "  # " + says;
    text_ += "\n";
  }

  std::string prefix_;
  std::string text_;
};

/// Checks every number against its rule.
class RangeCheck {
 public:
  RangeCheck(std::string file, std::string prefix)
      : file_(std::move(file)), prefix_(std::move(prefix)) {}

  void text(const std::string& /*key*/, const std::string& /*value*/, const char* /*says*/) {}
  void number(const NumberRule& rule, double value, const char* /*says*/) {
    if (value >= rule.least && value <= rule.most) return;  // NaN is not.
    throw InputError(file_ + ": " + prefix_ + rule.key + ": " + shortest_text(value) +
                     ": must be in " + shortest_text(rule.least) + " to " +
                     shortest_text(rule.most));
  }
  void needed(const NumberRule& rule, double value, const char* says) { number(rule, value, says); }
  void stated(const NumberRule& rule, double value, const char* says) {
    if (value != 0.0) number(rule, value, says);
  }
  void whole(const NumberRule& rule, int value, const char* says) { number(rule, value, says); }
  void flag(const std::string& /*key*/, bool /*value*/, const char* /*says*/) {}
  template <class Enum>
  void word(const std::string& /*key*/, Enum /*value*/, const char* /*says*/) {}
  template <class Item>
  void list(const std::string& key, std::vector<Item>& list, const char* /*says*/) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      RangeCheck inner(file_, prefix_ + key + "[" + std::to_string(i) + "].");
      describe(inner, list[i]);
    }
  }
  template <class Item>
  void table(const std::string& key, Item& item, const char* /*says*/) {
    RangeCheck inner(file_, prefix_ + key + ".");
    describe(inner, item);
  }

 private:
  std::string file_;
  std::string prefix_;
};

/// Finds the rule of one number.
class RuleSearch {
 public:
  explicit RuleSearch(std::string key, std::string prefix = {})
      : key_(std::move(key)), prefix_(std::move(prefix)) {}

  void text(const std::string& /*key*/, const std::string& /*value*/, const char* /*says*/) {}
  void number(const NumberRule& rule, double /*value*/, const char* /*says*/) {
    if (prefix_ + rule.key == key_) found_ = rule;
  }
  void needed(const NumberRule& rule, double value, const char* says) { number(rule, value, says); }
  void stated(const NumberRule& rule, double value, const char* says) { number(rule, value, says); }
  void whole(const NumberRule& rule, int value, const char* says) { number(rule, value, says); }
  void flag(const std::string& /*key*/, bool /*value*/, const char* /*says*/) {}
  template <class Enum>
  void word(const std::string& /*key*/, Enum /*value*/, const char* /*says*/) {}
  template <class Item>
  void list(const std::string& key, std::vector<Item>& /*list*/, const char* says) {
    Item item;
    table(key, item, says);
  }
  template <class Item>
  void table(const std::string& key, Item& item, const char* /*says*/) {
    RuleSearch inner(key_, prefix_ + key + ".");
    describe(inner, item);
    if (inner.found_) found_ = inner.found_;
  }
  [[nodiscard]] const std::optional<NumberRule>& found() const { return found_; }

 private:
  std::string key_;
  std::string prefix_;
  std::optional<NumberRule> found_;
};

template <class Visitor>
void describe_axes(Visitor& v, const std::string& key, Eigen::Vector3d& value,
                   const std::pair<double, double>& range, const char* says) {
  const char* const axes[] = {"_x", "_y", "_z"};
  for (int axis = 0; axis < 3; ++axis) {
    v.number({key + axes[axis], range.first, range.second}, value[axis], axis == 0 ? says : "");
  }
}

template <class Visitor>
void describe(Visitor& v, Machine& machine) {
  v.text("name", machine.name,
         "the paper's mill (Sun et al., Section 5); its limits below are "
         "assumed: put in your own");
  describe_axes(v, "travel", machine.travel, {kMinRate, kLength}, "mm");
  v.number({"spindle_min_rpm", 0.0, kSpin}, machine.spindle_min_rpm, "");
  v.number({"spindle_max_rpm", 1.0, kSpin}, machine.spindle_max_rpm, "the paper cuts at 23000");
  v.flag("spindle_by_hand", machine.spindle_by_hand,
         "a router that the operator switches: programs pause for it, without M3");
  describe_axes(v, "max_rate", machine.max_rate, {kMinRate, kRate}, "mm/min, rapids and feeds");
  describe_axes(v, "acceleration", machine.acceleration, {kMinRate, kRate}, "mm/s^2");
  v.number({"junction_deviation", 0.0, 1.0}, machine.junction_deviation,
           "mm that a corner may be rounded");
  v.number({"arc_tolerance", kMinLength, 1.0}, machine.arc_tolerance,
           "mm, of arcs as the controller splits them");
  describe_axes(v, "steps_per_mm", machine.steps_per_mm, {0.0, kRate}, "0: do not round to steps");
  v.whole({"look_ahead", 2, 100000}, machine.look_ahead, "moves planned ahead");
  v.number(
      {"lines_per_second", 0.0, kRate}, machine.lines_per_second,
      "maximum that the controller accepts, lines/s; 0: no limit; an 8-bit Grbl board takes 400");
}

template <class Visitor>
void describe(Visitor& v, Material& material) {
  v.text("name", material.name, "");
  v.stated({"ior", 1.000001, 5.0}, material.ior,
           "refractive index, checked against the lens's (Sun et al., Section 5: 1.49)");
}

template <class Visitor>
void describe(Visitor& v, Stock& stock) {
  v.number({"margin", 0.0, kBlank}, stock.margin, "mm beyond the lens's rectangle on every side");
  v.number({"allowance", 0.0, kBlank}, stock.allowance, "mm above the surface's highest point");
}

template <class Visitor>
void describe(Visitor& v, KeepOut& box) {
  v.text("name", box.name, "");
  describe_axes(v, "low", box.low, {-kLength, kLength}, "mm, lens frame");
  describe_axes(v, "high", box.high, {-kLength, kLength}, "");
}

template <class Visitor>
void describe(Visitor& v, ToolSection& section) {
  v.needed({"diameter", kMinLength, kBlank}, section.diameter, "mm");
  v.needed({"from", 0.0, kBlank}, section.from, "mm above the tip");
  v.needed({"to", kMinLength, kBlank}, section.to, "mm above the tip");
}

template <class Visitor>
void describe(Visitor& v, Tool& tool) {
  v.whole({"number", 1, 9999}, tool.number, "T word");
  v.text("name", tool.name, "");
  v.word("shape", tool.shape, "ball, bull or flat");
  v.needed({"diameter", kMinDiameter, 100.0}, tool.diameter, "mm");
  v.number({"corner_radius", 0.0, 50.0}, tool.corner_radius, "mm, of a bull");
  v.whole({"teeth", 1, 100}, tool.teeth, "for the report");
  v.needed({"flute_length", kMinLength, kBlank}, tool.flute_length,
           "mm above the tip that cut; above it nothing may touch material");
  v.number({"spindle_rpm", 1.0, kSpin}, tool.spindle_rpm, "");
  v.needed({"feed", kMinRate, kRate}, tool.feed, "mm/min");
  v.needed({"plunge", kMinRate, kRate}, tool.plunge, "mm/min into material");
  v.list("section", tool.sections, "Cylinders above the flutes, from below: neck, shank, holder.");
}

template <class Visitor, class Level>
void describe_following(Visitor& v, Level& process) {
  v.number({"stepover", kFinestStep, 100.0}, process.stepover, "mm between passes at most");
  v.number({"allowance", 0.0, 100.0}, process.allowance, "mm left on the surface");
  v.number({"ramp_angle_deg", 0.1, 45.0}, process.ramp_angle_deg, "steepest way into material");
  v.word("entry", process.entry, "ramp along the pass, or helix where one fits");
  v.number({"helix_radius", kMinHelix, 50.0}, process.helix_radius,
           "mm, of the tool's axis; half its diameter at most");
  v.number({"spacing", 0.001, 10.0}, process.spacing,
           "mm between points at which the surface is evaluated");
  v.word("style", process.style, "zigzag, climb or conventional");
  v.word("along", process.along, "x or y");
}

template <class Visitor>
void describe(Visitor& v, RoughProcess& rough) {
  v.flag("enabled", rough.enabled, "");
  v.whole({"tool", 1, 9999}, rough.tool, "number");
  v.number({"stepdown", kFinestStep, 100.0}, rough.stepdown, "mm between levels at most");
  describe_following(v, rough);
}

template <class Visitor>
void describe(Visitor& v, SemiProcess& semi) {
  v.flag("enabled", semi.enabled, "");
  v.whole({"tool", 1, 9999}, semi.tool, "number");
  describe_following(v, semi);
}

template <class Visitor>
void describe(Visitor& v, FinishProcess& finish) {
  v.whole({"tool", 1, 9999}, finish.tool, "number, of a ball");
  v.number({"pitch", kMinLength, 100.0}, finish.pitch,
           "mm between passes at most (Sun et al., Section 5: 0.06)");
  v.number({"scallop", 0.0, 10.0}, finish.scallop, "mm; above 0 the pitch follows from it");
  v.number({"tolerance", kFinestTolerance, 1.0}, finish.tolerance, "mm from the exact path");
  v.number({"slope_tolerance", kFinestSlope, 1.0}, finish.slope_tolerance,
           "rad from the exact path's direction");
  v.word("style", finish.style, "zigzag, climb or conventional");
  v.word("along", finish.along, "x or y");
  v.number({"pitch_error", -kMaxPitchError, kMaxPitchError}, finish.pitch_error,
           "share of a length that the machine goes too far across the passes; the predicted part "
           "has it, programs are not changed");
  v.flag("cross", finish.cross, "a second raster along the other axis");
  v.flag("pencil", finish.pencil, "a pass along concave creases");
  v.whole({"large_tool", 0, 9999}, finish.large_tool,
          "number of a larger ball that finishes wherever it reaches; 0: none");
  v.whole({"large_every", 1, 100}, finish.large_every,
          "rows of the finishing tool per row of the larger ball");
}

/// The rest of Process: its own keys.
template <class Visitor>
void describe(Visitor& v, Process& process) {
  v.number({"safe_height", kMinSafeHeight, kBlank}, process.safe_height,
           "mm of rapids above blank and clamps");
  v.number({"clearance", kMinClearance, 100.0}, process.clearance,
           "mm from clamps, and above material where the feed begins");
}

template <class Visitor>
void describe(Visitor& v, PolishModel& polish) {
  v.number({"sigma", 0.0, kMaxPolish}, polish.sigma,
           "mm, of the Gaussian that heights are averaged with; 0: not polished");
  v.number({"rim_depth", 0.0, kMaxPolish}, polish.rim_depth, "mm taken off in addition at the rim");
  v.number({"rim_length", 1e-3, 1000.0}, polish.rim_length,
           "mm from the rim over which that falls to a third");
}

template <class Visitor>
void describe(Visitor& v, WavinessBand& band) {
  v.needed({"wavelength", kShortestWave, kLength}, band.wavelength, "mm, middle of the band");
  v.needed({"rms_um", 0.0, kMaxError}, band.rms_um,
           "µm, root mean square, of the X and Y axes each");
}

template <class Visitor>
void describe(Visitor& v, Tolerances& t) {
  v.number({"row_um", 0.0, kMaxError}, t.row_um, "µm, height of a row against the next, sigma");
  v.number({"row_length", kShortestWave, kLength}, t.row_length, "mm over which that changes");
  v.number({"backlash_um", 0.0, kMaxError}, t.backlash_um,
           "µm, of the axis along the rows, 0 to this");
  v.number({"radius_um", 0.0, kMaxError}, t.radius_um, "µm, radius of the finishing ball, +- this");
  v.number({"runout_um", 0.0, kMaxError}, t.runout_um, "µm, total indicated, 0 to this");
  v.number({"polish_sigma", 0.0, kMaxPolishSpread}, t.polish_sigma,
           "share of the polish's sigma, from part to part, sigma");
  v.number({"polish_within", 0.0, kMaxPolishSpread}, t.polish_within, "the same over one part");
  v.number({"index", 0.0, 0.1}, t.index, "refractive index, +- this");
  v.number({"distance", 0.0, kBlank}, t.distance, "mm, distance of the screen, +- this");
  v.number({"tilt_deg", 0.0, 10.0}, t.tilt_deg, "degrees, of the part about x and about y, sigma");
  v.number({"source_mrad", 0.0, 20.0}, t.source_mrad,
           "mrad, full angle of the source seen from the lens, 0 to this; the sun has 9.3");
  v.number({"temperature_k", 0.0, 100.0}, t.temperature_k, "K, of the part, +- this");
  v.number({"expansion_per_k", 0.0, 1e-3}, t.expansion_per_k, "share of a length");
  v.number({"index_per_k", -1e-3, 1e-3}, t.index_per_k, "of the refractive index");
  v.list("waviness", t.waviness,
         "Waves that the machine's axes leave in the surface; rms_um = 0 for none.");
}

template <class Visitor>
void describe(Visitor& v, Workshop& shop) {
  v.table("machine", shop.machine, "The mill. Sizes are millimetres.");
  v.table("material", shop.material, "What the blank is made of.");
  v.table("stock", shop.stock, "The blank before the first cut; its flat entry face is z = 0.");
  v.list("keep_out", shop.keep_outs,
         "Boxes that no part of the tool may enter, in the lens's coordinates.");
  v.list(
      "tool", shop.tools,
      "Diameters, reach and feeds are examples of what makers offer for acrylic, 0.02 to 0.03 mm "
      "a tooth\n# (0.011 mm for the ball of 0.4 mm, which with 23000 rpm is the paper's).");
  v.table("process", shop.process, "");
  v.table("rough", shop.process.rough,
          "Level by level: a third of the tool's diameter deep, two fifths wide.");
  v.table("semi", shop.process.semi,
          "Evens out what roughing leaves, so that the finishing ball has little to cut.");
  v.table("finish", shop.process.finish, "The raster that makes the optical surface.");
  v.table("polish", shop.polish,
          "What polishing does to it. More σ blurs the picture, less leaves scallops.");
  v.table(
      "tolerances", shop.tolerances,
      "How far all this may be off, for cam --tolerances. \"sigma\" is a standard deviation, other "
      "bounds are uniform.");
}

}  // namespace

NumberRule workshop_rule(const std::string& key) {
  Workshop shop;
  RuleSearch search(key);
  describe(search, shop);
  LF_CHECK(search.found().has_value(), key);
  return *search.found();
}

void validate_ranges(const Workshop& workshop, const std::string& file) {
  Workshop shop = workshop;
  RangeCheck check(file, "");
  describe(check, shop);
}

Workshop parse_workshop(std::string_view text, const std::string& file) {
  const toml::table document = parse_toml(text, file);
  Workshop shop;
  Reader reader(TomlFields(document, {file, "a workshop"}));
  describe(reader, shop);
  reader.finish();
  validate(shop, file);
  return shop;
}

Workshop read_workshop(const std::filesystem::path& path) {
  return parse_workshop(read_toml_file(path, "a workshop"), path.string());
}

std::string workshop_toml(const Workshop& workshop) {
  Workshop shop = workshop;
  Writer writer;
  describe(writer, shop);
  return "# A workshop of lensforge cam: machine, blank, clamps, tools and process." +
         std::string("\n") + writer.result();
}

}  // namespace lensforge
