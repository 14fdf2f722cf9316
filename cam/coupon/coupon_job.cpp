// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon_job.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <system_error>
#include <utility>

#include "cam/job/job_files.h"
#include "cam/path/finish_raster.h"
#include "cam/path/rough.h"
#include "cam/post/program_part.h"
#include "cam/post/program_reader.h"
#include "cam/post/program_writer.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/page/html_page.h"
#include "core/schema/toml.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "coupon_page.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOperation = "coupon";

/// Grooves and marks are approached from the same side, from this far, so that a slide's backlash
/// does not shift them against one another; mm.
constexpr double kApproach = 1.0;

constexpr double kStockCell = 0.1;  ///< Of the model of the blank, mm, as cam's.

Eigen::AlignedBox3d blank_of(const CouponLayout& layout, double thickness) {
  const Eigen::Vector2d far = layout.xy(layout.size.x(), layout.size.y());
  return {Eigen::Vector3d::Zero(), Eigen::Vector3d(far.x(), far.y(), thickness)};
}

/// A level rectangle as large as the blank, facing up.
SurfaceMesh level_mesh(const Eigen::AlignedBox3d& blank, double z) {
  const double x = blank.max().x();
  const double y = blank.max().y();
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0.0, x, x, 0.0, 0.0, 0.0, y, y, z, z, z, z;
  mesh.triangles.resize(3, 2);
  mesh.triangles << 0, 0, 1, 2, 2, 3;
  return mesh;
}

int decimals_of(const CouponOptions& options) {
  const FinishProcess& finish = options.workshop.process.finish;
  return std::min(options.post.most_decimals,
                  decimals_for(finish.tolerance, finish.slope_tolerance));
}

}  // namespace

CouponPlan::CouponPlan(const CouponOptions& options, const Executor& executor)
    : options_(options),
      executor_(executor),
      layout_(coupon_layout(options)),
      blank_(blank_of(layout_, options.thickness)),
      decimals_(decimals_of(options)),
      floor_(level_mesh(blank_, top() - layout_.pad_depth)),
      deepest_(level_mesh(blank_, top() - layout_.deepest())),
      surface_(floor_, ball().radius(), executor),
      collisions_(deepest_, options_.workshop, StockMap(blank_, kStockCell)),
      watch_(collisions_, options_.workshop.tools, -top(),
             highest_obstacle(options_.workshop, blank_)) {}

const Tool& CouponPlan::ball() const {
  return options_.workshop.tool(options_.workshop.process.finish.tool);
}

double CouponPlan::resolution() const { return std::pow(10.0, -decimals_); }

double CouponPlan::rounded(double z) const {
  return to_resolution(z - top(), resolution()) + top();
}

double CouponPlan::safe_z() const { return rounded(safe_height_of(options_.workshop, blank_)); }

ProgramPlan CouponPlan::program(const RunControl& control) {
  ProgramPlan plan;
  plan.job = kOperation;
  plan.z_offset = -top();
  plan.safe_z = safe_z() - top();
  plan.comments = {"units: mm; X0 Y0: lower left corner of the blank", "Z0: top of the blank",
                   "blank: " + trimmed_decimal(blank_.sizes().x(), 3) + " x " +
                       trimmed_decimal(blank_.sizes().y(), 3) + " x " +
                       trimmed_decimal(blank_.sizes().z(), 3) + " mm"};
  plan.operations.push_back(
      {kOperation,
       ball(),
       {std::to_string(layout_.pads.size()) + " pads, a flat pad, " +
        std::to_string(layout_.grooves.size()) + " grooves, 2 marks " +
        trimmed_decimal(layout_.mark_distance(), 3) + " mm apart"},
       [this, &control](const MoveSink& sink) { return cut(sink, control); }});
  return plan;
}

ProgramSettings CouponPlan::settings() {
  ProgramSettings settings;
  settings.decimals = decimals_;
  settings.blend_tolerance = options_.workshop.process.finish.tolerance;
  settings.spin_up = options_.spin_up;
  settings.spindle_by_hand = options_.workshop.machine.spindle_by_hand;
  settings.coolant = options_.coolant;
  settings.planner = planner_settings(options_.workshop.machine);
  settings.look = [this](std::size_t /*operation*/, const ProgramLine& line) {
    watch_.take({kOperation, ball(), {}}, line);
  };
  return settings;
}

OperationSummary CouponPlan::cut(const MoveSink& sink, const RunControl& control) {
  OperationSummary summary;
  summary.name = kOperation;
  summary.tool = ball().number;
  cut_groove(layout_.marks[0], sink, summary);
  for (const CouponGroove& groove : layout_.grooves) cut_groove(groove, sink, summary);
  for (const CouponPad& pad : layout_.pads) {
    if (!cut_pad(pad, sink, control, summary)) return summary;
  }
  if (!cut_pad(layout_.flat, sink, control, summary)) return summary;
  cut_groove(layout_.marks[1], sink, summary);
  summary.complete = true;
  return summary;
}

void CouponPlan::cut_groove(const CouponGroove& groove, const MoveSink& sink,
                            OperationSummary& summary) const {
  const auto point = [&](double along, double across, double z) {
    const Eigen::Vector2d place =
        layout_.xy(to_resolution(along, resolution()), to_resolution(across, resolution()));
    return Eigen::Vector3d(place.x(), place.y(), z);
  };
  const double bottom = rounded(top() - groove.depth);
  const Eigen::Vector3d begin = point(groove.along_begin, groove.across, bottom);
  const Eigen::Vector3d end = point(groove.along_end, groove.across, bottom);
  // A groove is cut at the feed of plunges: the ball is in material all round.
  const double feed = ball().plunge;
  const auto move = [&](MoveKind kind, const Eigen::Vector3d& to) {
    return PathMove{.kind = kind, .end = to, .feed = kind == MoveKind::kRapid ? 0.0 : feed};
  };
  const std::array moves{
      move(MoveKind::kRapid, point(groove.along_begin, groove.across - kApproach, safe_z())),
      move(MoveKind::kRapid, point(groove.along_begin, groove.across, safe_z())),
      move(MoveKind::kPlunge, begin), move(MoveKind::kCut, end),
      move(MoveKind::kRapid, point(groove.along_end, groove.across, safe_z()))};
  sink(moves);
  ++summary.passes;
  summary.moves += static_cast<std::int64_t>(moves.size());
  summary.cutting_length += (end - begin).norm() + safe_z() - bottom;
  summary.tip.extend(begin).extend(end);
}

bool CouponPlan::cut_pad(const CouponPad& pad, const MoveSink& sink, const RunControl& control,
                         OperationSummary& summary) const {
  const FinishProcess& finish = options_.workshop.process.finish;
  RasterOptions raster;
  raster.pitch = pad.pitch;
  raster.tolerance = finish.tolerance;
  raster.slope_tolerance = finish.slope_tolerance;
  raster.resolution = resolution();
  raster.z_zero = top();
  raster.along = layout_.along;
  raster.style = finish.style;
  const Eigen::Vector2d low = layout_.xy(pad.box.min().x(), pad.box.min().y());
  const Eigen::Vector2d high = layout_.xy(pad.box.max().x(), pad.box.max().y());
  const RasterPlan plan = plan_finish_raster({low, high}, layout_.radius, raster);
  const OperationSummary one =
      cut_finish(surface_, plan, {kOperation, ball(), safe_z(), {}}, executor_, sink, control);
  summary.passes += one.passes;
  summary.moves += one.moves;
  summary.cutting_length += one.cutting_length;
  summary.rapid_length += one.rapid_length;
  summary.tip.extend(one.tip);
  return one.complete;
}

std::vector<std::string> CouponPlan::faults() const {
  std::vector<std::string> sentences = watch_.faults();
  for (const Collision& collision : collisions_.collisions()) {
    sentences.push_back(collision.sentence());
  }
  for (const SteepDescent& descent : collisions_.descents()) {
    sentences.push_back(descent.sentence(std::string(kOperation) + "." + options_.post.extension));
  }
  const std::string travel = travel_fault(watch_.extent(), options_.workshop.machine.travel);
  if (!travel.empty()) sentences.push_back(travel);
  return sentences;
}

namespace {

constexpr double kSecondsPerMinute = 60.0;

/// True if it can be read as readings and has none.
bool holds_no_readings(const fs::path& file) {
  try {
    return parse_readings(read_toml_file(file, "a file of readings"), file.string()).count() == 0;
  } catch (const InputError&) {
    return false;
  }
}

/// Readings at the bench are not overwritten.
void require_no_readings(const fs::path& file, bool force) {
  std::error_code error;
  if (force || !fs::exists(file, error) || holds_no_readings(file)) return;
  throw InputError(file.string() + ": holds readings; move it away or replace it with --force");
}

CouponSheet sheet_of(const CouponOptions& options, const CouponPlan& plan,
                     const ProgramFiles& programs) {
  CouponSheet sheet;
  sheet.layout = plan.layout();
  sheet.expected = expected_readings(sheet.layout, options.workshop);
  sheet.known = expected_fit(sheet.expected, options.workshop);
  const Tool& ball = options.workshop.tool(options.workshop.process.finish.tool);
  sheet.tool = tool_text(ball);
  for (const WrittenProgram& file : programs.files) {
    sheet.files = with_word(sheet.files, file.path.filename().string());
  }
  sheet.minutes = programs.total.seconds / kSecondsPerMinute;
  sheet.thickness = options.thickness;
  sheet.warnings = plan.faults();
  return sheet;
}

/// Removes programs of an earlier coupon in another dialect, which the sheet does not describe.
void remove_earlier(const fs::path& folder, const std::vector<fs::path>& written) {
  for (const fs::path& path : other_programs(folder, written).earlier) {
    std::error_code ignored;
    if (is_name_of_coupon(path.filename().string())) fs::remove(path, ignored);
  }
}

CouponResult make(const CouponOptions& options, const fs::path& folder, const Executor& executor,
                  const RunControl& control) {
  CouponPlan plan(options, executor.with_stop(control.stop_token()));
  const ProgramPlan program = plan.program(control);
  const ProgramSettings settings = plan.settings();
  constexpr std::array kOthers{coupon_file::kSheet, coupon_file::kReadings};
  require_replaceable_cut(folder, programs_in_the_way(program, options.post, settings, folder),
                          kOthers, options.force);
  require_no_readings(folder / coupon_file::kReadings, options.force);
  PendingPrograms programs(program, options.post, settings, folder, control);
  const CouponSheet sheet = sheet_of(options, plan, programs.programs());
  PendingFiles files(folder);
  files.add(coupon_file::kSheet, coupon_sheet(sheet));
  files.add(coupon_file::kReadings, readings_template(sheet.expected));
  programs.publish();
  CouponResult result;
  for (const WrittenProgram& file : programs.programs().files) result.files.push_back(file.path);
  remove_earlier(folder, result.files);
  for (const fs::path& path : files.publish()) result.files.push_back(path);
  result.layout = sheet.layout;
  result.known = sheet.known;
  result.minutes = sheet.minutes;
  result.faults = sheet.warnings;
  return result;
}

}  // namespace

bool is_name_of_coupon(const std::string& name) {
  return name == coupon_file::kReadings || fs::path(name).stem().string().starts_with("coupon");
}

CouponResult make_coupon(const CouponOptions& options, const fs::path& folder,
                         const Executor& executor, const RunControl& control) {
  validate(options);
  try {
    require_writable_folder(folder);
    return make(options, folder, executor, control);
  } catch (const Interrupted&) {
    CouponResult interrupted;
    interrupted.status = CouponResult::Status::kInterrupted;
    return interrupted;
  }
}

namespace {

constexpr double kWidth = 560.0;  ///< Of the picture; all its lengths are in its own units.
constexpr double kMargin = 74.0;

/// The coupon in machine coordinates, y upwards.
class Drawing {
 public:
  explicit Drawing(const CouponLayout& layout)
      : layout_(layout), size_(layout.xy(layout.size.x(), layout.size.y())) {
    scale_ = (kWidth - 2.0 * kMargin) / size_.maxCoeff();
    svg_.add(
        {"<defs><marker id=\"tick\" viewBox=\"-5 -5 10 10\" markerWidth=\"9\" markerHeight=\"9\" "
         "orient=\"auto\"><path d=\"M-3 3L3 -3M0 -5V5\" stroke=\"#1a1f24\"/></marker></defs>"});
  }

  [[nodiscard]] double width() const { return scale_ * size_.x() + 2.0 * kMargin; }
  [[nodiscard]] double height() const { return scale_ * size_.y() + 2.0 * kMargin; }

  /// @param low, high  (x, y), mm.
  void box(const Eigen::Vector2d& low, const Eigen::Vector2d& high, const std::string& style) {
    svg_.rectangle({x(low.x()), y(high.y())}, scale_ * (high - low), style);
  }
  /// A cut of the ball: a line as wide as it.
  void cut(const CouponGroove& groove) {
    const double wide = std::max(1.5, 2.0 * scale_ * layout_.radius);
    svg_.line(
        at(layout_.xy(groove.along_begin, groove.across)),
        at(layout_.xy(groove.along_end, groove.across)),
        svg_.attribute("stroke-width", wide) + " stroke=\"#0b5cad\" stroke-linecap=\"round\"");
  }
  /// @param anchor  start, middle or end.
  void words(const Eigen::Vector2d& place, const std::string& text, const std::string& anchor,
             const Eigen::Vector2d& shift = {0.0, 0.0}) {
    svg_.text(at(place) + shift, joined({"text-anchor=\"", anchor, "\""}), text);
  }
  void words_upwards(const Eigen::Vector2d& place, const std::string& text,
                     const Eigen::Vector2d& shift) {
    svg_.add({"<text transform=\"translate(", svg_.pair(at(place) + shift, " "), ") rotate(-90)\">",
              escape_html(text), "</text>"});
  }
  /// A dimension between two places with the same x or the same y, `off` beside them.
  void dimension(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double off,
                 const std::string& text) {
    const bool level = from.y() == to.y();
    const Eigen::Vector2d shift = level ? Eigen::Vector2d(0.0, off) : Eigen::Vector2d(off, 0.0);
    const Eigen::Vector2d a = at(from) + shift;
    const Eigen::Vector2d b = at(to) + shift;
    svg_.line(a, b, "stroke=\"#1a1f24\" marker-start=\"url(#tick)\" marker-end=\"url(#tick)\"");
    const Eigen::Vector2d middle = 0.5 * (a + b);
    const Eigen::Vector2d beside =
        middle - (level ? Eigen::Vector2d(0.0, 5.0) : Eigen::Vector2d(5.0, 0.0));
    const std::string turn =
        level ? "" : " transform=\"rotate(-90 " + svg_.pair(beside, " ") + ")\"";
    svg_.text(beside, "text-anchor=\"middle\"" + turn, text);
  }
  void zero() {
    svg_.circle(at({0.0, 0.0}), "r=\"5\" fill=\"#fff\" stroke=\"#a3161a\" stroke-width=\"2.5\"");
    words({0.0, 0.0}, "X0 Y0", "end", {-9.0, 16.0});
  }
  [[nodiscard]] std::string result() const {
    return svg_.drawing(
        joined({"viewBox=\"0 0 ", decimal_text(width(), 0), " ", decimal_text(height(), 0),
                "\" role=\"img\" aria-label=\"Coupon from above\"",
                " font-family=\"Arial, sans-serif\" font-size=\"13\""}));
  }

 private:
  [[nodiscard]] double x(double mm) const { return kMargin + scale_ * mm; }
  [[nodiscard]] double y(double mm) const { return height() - kMargin - scale_ * mm; }
  [[nodiscard]] Eigen::Vector2d at(const Eigen::Vector2d& mm) const {
    return {x(mm.x()), y(mm.y())};
  }

  const CouponLayout& layout_;
  Eigen::Vector2d size_;
  double scale_ = 1.0;
  SvgWriter svg_{2};
};

void draw_pad(const CouponLayout& layout, const CouponPad& pad, const std::string& name,
              Drawing& drawing) {
  const Eigen::Vector2d low = layout.xy(pad.box.min().x(), pad.box.min().y());
  const Eigen::Vector2d high = layout.xy(pad.box.max().x(), pad.box.max().y());
  drawing.box(low, high, "fill=\"#b9d3ea\" stroke=\"#0b5cad\"");
  const std::string pitch = trimmed_decimal(pad.pitch, 3);
  if (layout.along == 0) {
    const Eigen::Vector2d middle = 0.5 * (low + high);
    drawing.words(middle, name, "middle", {0.0, -4.0});
    drawing.words(middle, pitch, "middle", {0.0, 13.0});
  } else {
    drawing.words({high.x(), 0.5 * (low.y() + high.y())}, joined({name, " ", pitch}), "start",
                  {7.0, 4.5});
  }
}

void draw_pads(const CouponLayout& layout, Drawing& drawing) {
  for (std::size_t i = 0; i < layout.pads.size(); ++i) {
    draw_pad(layout, layout.pads[i], feature_name('P', i), drawing);
  }
  draw_pad(layout, layout.flat, kFlatName, drawing);
}

void draw_grooves(const CouponLayout& layout, Drawing& drawing) {
  for (std::size_t i = 0; i < layout.grooves.size(); ++i) {
    const CouponGroove& groove = layout.grooves[i];
    drawing.cut(groove);
    const Eigen::Vector2d end = layout.xy(groove.along_end + layout.radius, groove.across);
    if (layout.along == 0) {
      drawing.words(end, feature_name('G', i), "start", {5.0, 4.5});
    } else {
      drawing.words_upwards(end, feature_name('G', i), {4.5, -5.0});
    }
  }
  for (std::size_t i = 0; i < layout.marks.size(); ++i) {
    const CouponGroove& mark = layout.marks[i];
    drawing.cut(mark);
    const Eigen::Vector2d middle =
        layout.xy(0.5 * (mark.along_begin + mark.along_end), mark.across);
    drawing.words(middle, i == 0 ? "A" : "B", "middle",
                  layout.along == 0 ? Eigen::Vector2d(0.0, -8.0) : Eigen::Vector2d(-10.0, 4.0));
  }
}

void draw_dimensions(const CouponLayout& layout, Drawing& drawing) {
  const Eigen::Vector2d size = layout.xy(layout.size.x(), layout.size.y());
  const auto mm = [](double value) { return trimmed_decimal(value, 3); };
  drawing.dimension({0.0, 0.0}, {size.x(), 0.0}, 46.0, mm(size.x()));
  drawing.dimension({0.0, 0.0}, {0.0, size.y()}, -44.0, mm(size.y()));
  const double end = layout.size.x();
  const Eigen::Vector2d a = layout.xy(end, layout.marks[0].across);
  const Eigen::Vector2d b = layout.xy(end, layout.marks[1].across);
  drawing.dimension(a, b, layout.along == 0 ? 34.0 : -24.0, "A–B " + mm(layout.mark_distance()));
}

}  // namespace

std::string coupon_drawing(const CouponLayout& layout) {
  Drawing drawing(layout);
  drawing.box({0.0, 0.0}, layout.xy(layout.size.x(), layout.size.y()),
              "fill=\"#eef4fa\" stroke=\"#1a1f24\" stroke-width=\"2\"");
  draw_pads(layout, drawing);
  draw_grooves(layout, drawing);
  draw_dimensions(layout, drawing);
  drawing.zero();
  return drawing.result();
}

namespace {

constexpr double kMicrometres = 1e3;

constexpr const char* kHowMarks =
    "distance, centre to centre: calliper's points in the marks, or a measuring microscope";

using Rows = std::vector<std::vector<std::string>>;

const std::array<TableColumn, 6> kColumns{{{"where"},
                                           {"programmed", true},
                                           {"what, and with what"},
                                           {"expected", true},
                                           {"key under its name"},
                                           {"read off"}}};

std::string mm(double value) { return trimmed_decimal(value, 4) + " mm"; }
std::string um(double value) { return number_text(kMicrometres * value, 3) + " µm"; }
std::string rough_um(double value) { return number_text(kMicrometres * value, 2) + " µm"; }
std::string code(const std::string& text) { return element("code", "", escape_html(text)); }

std::string before_table(const CouponSheet& sheet) {
  const CouponReadings& expected = sheet.expected;
  Rows rows;
  for (const MarkReadings& mark : expected.marks) {
    rows.push_back({"A to B", mm(mark.programmed), kHowMarks, mm(mark.distance->value),
                    code("distance_mm"), ""});
  }
  for (std::size_t i = 0; i < expected.grooves.size(); ++i) {
    const GrooveReadings& groove = expected.grooves[i];
    rows.push_back({feature_name('G', i), mm(groove.depth) + " deep",
                    "width at the top: microscope with a scale", mm(groove.width->value),
                    code("width_mm"), ""});
  }
  for (std::size_t i = 0; i < expected.pads.size(); ++i) {
    const PadReadings& pad = expected.pads[i];
    rows.push_back({feature_name('P', i), "pitch " + mm(pad.pitch),
                    "height of the scallops: Rz of a roughness tester across the passes",
                    um(pad.before->value), code("before_um"), ""});
  }
  return html_table(kColumns, rows);
}

std::string after_table(const CouponSheet& sheet) {
  Rows rows;
  for (std::size_t i = 0; i < sheet.expected.pads.size(); ++i) {
    const PadReadings& pad = sheet.expected.pads[i];
    const std::string name = feature_name('P', i);
    const std::string pitch = "pitch " + mm(pad.pitch);
    if (pad.after) {
      rows.push_back({name, pitch,
                      "height of the ripples: the same roughness tester, or an interferometer",
                      um(pad.after->value), code("after_um"), ""});
    }
    if (!pad.orders) continue;
    rows.push_back(
        {name, pitch,
         "light of a first spot over that of the middle one: laser pointer and light meter",
         number_text(pad.orders->value, 2), code("order_ratio"), ""});
  }
  for (const HazeReadings& haze : sheet.expected.haze) {
    rows.push_back({kFlatName, "pitch " + mm(sheet.layout.flat.pitch),
                    "light " + number_text(haze.place.angle, 3) +
                        "° from the beam over that of the beam: laser pointer and photodiode",
                    haze.ratio ? number_text(haze.ratio->value, 2) : "not known",
                    code("light_ratio"), ""});
  }
  return html_table(kColumns, rows);
}

/// Expected accuracy of all readings together.
std::string known(const CouponFit& fit) {
  const auto words = [](const char* name, const FittedValue& value, const std::string& text) {
    return std::string(name) + " to " +
           (value.determined ? text : std::string("no useful accuracy"));
  };
  const std::string sigma = words("the polish's σ", fit.sigma, rough_um(fit.sigma.uncertainty));
  const std::string ball =
      words("the ball's diameter", fit.diameter, rough_um(fit.diameter.uncertainty));
  const std::string pitch = words("the pitch error", fit.pitch_error,
                                  number_text(100.0 * fit.pitch_error.uncertainty, 2) + " %");
  const std::string roughness = fit.haze
                                    ? words(", the polish's roughness", fit.roughness,
                                            number_text(fit.roughness.uncertainty, 2) + " nm") +
                                          words(", its correlation length", fit.correlation,
                                                number_text(fit.correlation.uncertainty, 2) + " µm")
                                    : std::string();
  const std::string order = fit.order.determined
                                ? "; it tells the order of the polish by " +
                                      number_text(fit.order_apart, 2) + " standard errors"
                                : "; it does not tell the order of the polish";
  return element(
      "p", "",
      escape_html("With every reading of this sheet, and the uncertainties that the file "
                  "states, the fit tells " +
                  sigma + roughness + ", " + ball + " and " + pitch + order + "."));
}

/// Distance of the first spot from the middle one on the first pad, a metre behind it.
std::string spot_distance(const CouponSheet& sheet) {
  constexpr double kMetre = 1000.0;
  const double angle = sheet.expected.light.wavelength / sheet.layout.pads.front().pitch;
  return trimmed_decimal(kMetre * angle, 1) + " mm";
}

std::string warnings(const CouponSheet& sheet) {
  if (sheet.warnings.empty()) return "";
  std::string items;
  for (const std::string& warning : sheet.warnings) {
    items += element("p", "", escape_html(warning));
  }
  return element("div", "class=\"warnings\"", items);
}

double shallowest(const CouponLayout& layout) {
  double least = layout.grooves.front().depth;
  for (const CouponGroove& groove : layout.grooves) least = std::min(least, groove.depth);
  return least;
}

}  // namespace

std::string coupon_sheet(const CouponSheet& sheet) {
  const CouponLayout& layout = sheet.layout;
  const Eigen::Vector2d size = layout.xy(layout.size.x(), layout.size.y());
  const std::string blank =
      mm(size.x()) + " x " + mm(size.y()) + ", " + mm(sheet.thickness) + " thick";
  const std::string along =
      std::string("Passes run along ") + (layout.along == 0 ? "X" : "Y") +
      ". Pads, with their pitches: " + mm(layout.pads.front().box.sizes().x()) +
      " along the passes, " + mm(layout.pads.front().box.sizes().y()) + " across, " +
      mm(layout.pad_depth) + " deep. The flat pad " + kFlatName + ": " +
      mm(layout.flat.box.sizes().x()) + " along, " + mm(layout.flat.box.sizes().y()) +
      " across, as deep.";
  const std::array<std::pair<std::string_view, std::string>, 14> values{{
      {"PROGRAM", program_mark()},
      {"STYLE", std::string(coupon_page::kStyle)},
      {"TOOL", escape_html(sheet.tool)},
      {"TIME", duration_text(sheet.minutes)},
      {"WARNINGS", warnings(sheet)},
      {"DRAWING", coupon_drawing(layout)},
      {"ALONG", along},
      {"BLANK", blank},
      {"SHALLOWEST", mm(shallowest(layout))},
      {"FILES", escape_html(sheet.files)},
      {"KNOWN", known(sheet.known)},
      {"BEFORE", before_table(sheet)},
      {"AFTER", after_table(sheet)},
      {"SPOTS", spot_distance(sheet)},
  }};
  return fill_in(coupon_page::kHtml, values);
}

}  // namespace lensforge
