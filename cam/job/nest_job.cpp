// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/job/nest_job.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <system_error>
#include <utility>

#include "cam/cam.h"
#include "cam/job/cut_job.h"
#include "cam/job/cut_report.h"
#include "cam/job/job_files.h"
#include "cam/path/outline_cut.h"
#include "cam/path/rough.h"
#include "cam/post/program_writer.h"
#include "cam/report/report_data.h"
#include "core/error.h"
#include "core/io/lens_folder.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Rounding allowed where rectangles end at the blank's edge, mm.
constexpr double kRounding = 1e-9;

double on_step(double value) { return kNestStep * std::ceil(value / kNestStep - 1e-6); }

struct Row {
  double low = 0.0;     ///< Least y of its rectangles.
  double height = 0.0;  ///< Of the first one, which is the highest.
  double end = 0.0;     ///< Greatest x occupied.
};

/// All rows, as high as they need to be.
struct Rows {
  std::vector<Eigen::Vector2d> corners;
  double width = 0.0;   ///< Required by the widest rectangle.
  double height = 0.0;  ///< Required by all rows.
};

Rows stacked(const std::vector<NestItem>& items, const NestSheet& sheet) {
  std::vector<std::size_t> order(items.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return items[a].size.y() > items[b].size.y();
  });
  const double first = on_step(sheet.edge);
  Rows all;
  all.corners.resize(items.size());
  std::vector<Row> rows;
  for (const std::size_t k : order) {
    const Eigen::Vector2d& size = items[k].size;
    all.width = std::max(all.width, first + size.x() + sheet.edge);
    const auto has_room = [&](const Row& row) {
      return on_step(row.end + sheet.gap) + size.x() + sheet.edge <= sheet.size.x() + kRounding;
    };
    auto row = std::find_if(rows.begin(), rows.end(), has_room);
    double x = first;
    if (row == rows.end()) {
      const double low =
          rows.empty() ? first : on_step(rows.back().low + rows.back().height + sheet.gap);
      row = rows.insert(row, {low, size.y(), 0.0});
    } else {
      x = on_step(row->end + sheet.gap);
    }
    all.corners[k] = {x, row->low};
    row->end = x + size.x();
    all.height = std::max(all.height, row->low + row->height + sheet.edge);
  }
  return all;
}

std::string size_words(const Eigen::Vector2d& size) {
  return trimmed_decimal(size.x(), 2) + " x " + trimmed_decimal(size.y(), 2) + " mm";
}

}  // namespace

std::vector<Eigen::Vector2d> place_in_rows(const std::vector<NestItem>& items,
                                           const NestSheet& sheet) {
  Rows rows = stacked(items, sheet);
  const Eigen::Vector2d needed(std::max(sheet.size.x(), on_step(rows.width)),
                               std::max(sheet.size.y(), on_step(rows.height)));
  if (rows.width > sheet.size.x() + kRounding) {
    NestSheet wider = sheet;
    wider.size.x() = needed.x();
    rows = stacked(items, wider);
  } else if (!(rows.height > sheet.size.y() + kRounding)) {
    return std::move(rows.corners);
  }
  throw InputError("--blank " + size_words(sheet.size) + ": is too small for the lenses, " +
                   trimmed_decimal(sheet.gap, 2) + " mm apart and " +
                   trimmed_decimal(sheet.edge, 2) + " mm from its edge: " +
                   size_words({needed.x(), std::max(sheet.size.y(), on_step(rows.height))}) +
                   " works");
}

namespace {

/// Maximum difference of refractive indices on one sheet, as in the reports' check of the material.
constexpr double kSameIndex = 0.005;

std::string mm(double value) { return trimmed_decimal(value, 3) + " mm"; }

void require_options(const NestOptions& options) {
  const Eigen::Vector2d& blank = options.blank;
  if (!(blank.allFinite() && blank.minCoeff() > 0.0)) {
    throw InputError("--blank " + trimmed_decimal(blank.x(), 3) + "," +
                     trimmed_decimal(blank.y(), 3) + ": both sides must be above 0");
  }
  if (options.cam.part == PartKind::kMould) {
    throw InputError("--part mould: a mould has a blank of its own; cut it with cam");
  }
  if (options.cam.z_zero == ZZero::kLens) {
    throw InputError("--z-zero lens: lenses of one blank differ in height; must be stock or table");
  }
}

/// Checks that lenses of one sheet match.
void require_alike(const std::vector<NestLens>& lenses) {
  if (lenses.empty()) throw InputError("DIR: no lens folder is named; must be one or more");
  const OpticalSetup& first = lenses.front().lens->setup;
  for (const NestLens& one : lenses) {
    const OpticalSetup& setup = one.lens->setup;
    if (setup.body != first.body) {
      throw InputError(one.name + ": is a " + traits(setup.body).name + ", " + lenses.front().name +
                       " is a " + traits(first.body).name +
                       ": one blank is for one kind; nest them apart");
    }
    if (setup.front) {
      throw InputError(one.name +
                       ": has a curved front, which its blank has before the first cut; cut it "
                       "alone with cam");
    }
    if (traits(setup.body).transmits && !(std::abs(setup.ior - first.ior) <= kSameIndex)) {
      throw InputError(one.name + ": was designed for index " + trimmed_decimal(setup.ior, 4) +
                       ", " + lenses.front().name + " for " + trimmed_decimal(first.ior, 4) +
                       ": one blank has one material, within 0.005");
    }
  }
}

/// What is cut of every lens, box_to_cut().
using Boxes = std::vector<Eigen::AlignedBox3d>;

Boxes boxes_of(const std::vector<NestLens>& lenses, const CamOptions& options) {
  Boxes boxes;
  boxes.reserve(lenses.size());
  for (const NestLens& one : lenses) boxes.push_back(box_to_cut(*one.lens, options));
  return boxes;
}

/// Number of the lens with the highest box.
std::size_t highest_of(const Boxes& boxes) {
  const auto lower = [](const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
    return a.max().z() < b.max().z();
  };
  return static_cast<std::size_t>(std::max_element(boxes.begin(), boxes.end(), lower) -
                                  boxes.begin());
}

double thickness_for(const Boxes& boxes, const NestOptions& options) {
  return boxes[highest_of(boxes)].max().z() + options.cam.workshop.stock.allowance;
}

/// Thickness of the common blank: as given, or what the highest lens needs. @throw InputError
double thickness_of(const std::vector<NestLens>& lenses, const Boxes& boxes,
                    const NestOptions& options) {
  const double needed = thickness_for(boxes, options);
  const double thickness = options.thickness.value_or(needed);
  if (thickness >= needed) return thickness;
  throw InputError("--blank: a thickness of " + mm(thickness) + " is too little for " +
                   lenses[highest_of(boxes)].name + ": must be at least " +
                   trimmed_decimal(std::ceil(1e3 * needed) / 1e3, 3) + " mm, --stock " +
                   trimmed_decimal(options.cam.workshop.stock.allowance, 3) + " included");
}

/// Room that tools need around every lens, mm.
struct Room {
  double slot = 0.0;    ///< Width of the cut around lenses; 0 if none is cut out.
  double gap = 0.0;     ///< Between lenses.
  double edge = 0.0;    ///< Between lenses and the blank's edge.
  double margin = 0.0;  ///< Of each lens's own blank.
};

Room room_for(const std::vector<NestLens>& lenses, const Boxes& boxes, const NestOptions& options,
              double top) {
  const Workshop& workshop = options.cam.workshop;
  const Process& process = workshop.process;
  const double apron = apron_to_cut(options.cam);
  double reach = 0.0;
  Room room;
  for (const Eigen::AlignedBox3d& box : boxes) {
    reach = std::max(reach, apron + rough_reach(workshop, box, top));
  }
  for (const NestLens& one : lenses) {
    if (!cuts_outline(options.cam, one.lens->setup)) continue;
    const int number = options.cam.outline_tool > 0 ? options.cam.outline_tool : process.rough.tool;
    room.slot = workshop.tool(number).diameter;
  }
  const double frame = room.slot > 0.0 ? room.slot + kTabFrame : 0.0;
  const double widest = std::max(workshop.tool(process.rough.tool).diameter,
                                 workshop.tool(process.semi.tool).diameter);
  room.gap = std::max(reach + apron + process.clearance, room.slot > 0.0 ? frame + room.slot : 0.0);
  room.edge = std::max({workshop.stock.margin, frame, apron});
  // A roughing closer to the edge than its tool's radius removes the rest there.
  room.margin = std::max({room.edge, frame, reach + widest});
  return room;
}

double gap_of(const NestOptions& options, const Room& room) {
  if (options.gap == 0.0) return room.gap;
  if (options.gap >= room.gap) return options.gap;
  throw InputError("--gap " + trimmed_decimal(options.gap, 3) + ": must be at least " +
                   trimmed_decimal(std::ceil(1e3 * room.gap) / 1e3, 3) +
                   " mm for the tools, or 0 for that");
}

/// Options of one lens: the workshop with clamps placed relative to that lens, and its own blank.
/// @param allowance  between the highest point that is cut and the blank's top, mm.
CamOptions cut_of(const NestOptions& options, const NestedLens& placed, const Room& room,
                  double allowance) {
  CamOptions cut = options.cam;
  cut.job = placed.name;
  cut.workshop.stock.margin = room.margin;
  cut.workshop.stock.allowance = allowance;
  for (KeepOut& clamp : cut.workshop.keep_outs) {
    clamp.low.head<2>() -= placed.box.min();
    clamp.high.head<2>() -= placed.box.min();
  }
  return cut;
}

}  // namespace

double least_thickness(const std::vector<NestLens>& lenses, const NestOptions& options) {
  return thickness_for(boxes_of(lenses, options.cam), options);
}

NestPlan plan_nest(const std::vector<NestLens>& lenses, const NestOptions& options) {
  require_options(options);
  require_alike(lenses);
  const Boxes boxes = boxes_of(lenses, options.cam);
  const double top = thickness_of(lenses, boxes, options);
  const Room room = room_for(lenses, boxes, options, top);
  NestPlan plan;
  plan.layout.blank = {options.blank.x(), options.blank.y(), top};
  plan.layout.gap = gap_of(options, room);
  plan.layout.edge = room.edge;
  plan.layout.slot = room.slot;
  plan.layout.keep_outs = options.cam.workshop.keep_outs;
  std::vector<NestItem> items;
  items.reserve(lenses.size());
  for (const NestLens& one : lenses) items.push_back({one.name, one.lens->setup.lens_size});
  const std::vector<Eigen::Vector2d> corners =
      place_in_rows(items, {options.blank, plan.layout.gap, room.edge});
  for (std::size_t k = 0; k < lenses.size(); ++k) {
    NestedLens placed;
    placed.name = lenses[k].name;
    placed.box = {corners[k], Eigen::Vector2d(corners[k] + items[k].size)};
    placed.outline = edge_of(lenses[k].lens->setup);
    for (Eigen::Vector2d& p : placed.outline) p += corners[k];
    placed.cut_out = cuts_outline(options.cam, lenses[k].lens->setup);
    plan.cuts.push_back(cut_of(options, placed, room, top - boxes[k].max().z()));
    validate(plan.cuts.back(), lenses[k].lens->setup);
    plan.layout.lenses.push_back(std::move(placed));
  }
  return plan;
}

WorkEstimate estimate_nest(const NestPlan& plan, const std::vector<NestLens>& lenses, int threads) {
  WorkEstimate sum;
  for (std::size_t k = 0; k < lenses.size(); ++k) {
    const WorkEstimate one = estimate_cut(plan.cuts[k], *lenses[k].lens, threads);
    sum.seconds += one.seconds;
    sum.disk_bytes += one.disk_bytes;
    sum.memory_bytes += one.memory_bytes;
  }
  return sum;
}

namespace {

/// Heights of letters and widths of lines, shares of the blank's longer side.
constexpr double kLetters = 0.022;
constexpr double kLine = 0.002;
constexpr double kMargin = 0.12;

/// Mean width of a letter, in heights.
constexpr double kLetterWidth = 0.6;

/// Draws with y up, as on the machine.
class Drawing {
 public:
  explicit Drawing(const NestLayout& layout)
      : layout_(layout), longer_(layout.blank.head<2>().maxCoeff()) {
    margin_ = kMargin * longer_;
  }

  std::string draw() {
    begin();
    box({Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(layout_.blank.head<2>())},
        "fill=\"#e3ecf5\" stroke=\"#1a1f24\"");
    for (const NestedLens& lens : layout_.lenses) cut(lens);
    for (const NestedLens& lens : layout_.lenses) part(lens);
    for (const KeepOut& clamp : layout_.keep_outs) keep_out(clamp);
    dimensions();
    zero();
    const Eigen::Vector2d size = sheet();
    return svg_.drawing(joined({"xmlns=\"http://www.w3.org/2000/svg\" width=\"", number(size.x()),
                                "mm\" height=\"", number(size.y()), "mm\" viewBox=\"",
                                svg_.pair({-margin_, -margin_}, " "), " ", svg_.pair(size, " "),
                                "\" font-family=\"sans-serif\" ",
                                svg_.attribute("stroke-width", kLine * longer_)})) +
           "\n";
  }

 private:
  [[nodiscard]] std::string number(double value) const { return svg_.number(value); }
  [[nodiscard]] double y(double up) const { return layout_.blank.y() - up; }
  [[nodiscard]] Eigen::Vector2d sheet() const {
    return {layout_.blank.x() + 2.0 * margin_, layout_.blank.y() + 2.0 * margin_};
  }

  void begin() {
    svg_.add({"\n<!-- ", program_mark(), " -->\n<title>", std::to_string(layout_.lenses.size()),
              " on one blank</title>"});
    svg_.rectangle({-margin_, -margin_}, sheet(), "fill=\"#fff\"");
  }

  void box(const Eigen::AlignedBox2d& at, std::string_view style) {
    svg_.rectangle({at.min().x(), y(at.max().y())}, at.sizes(), style);
  }

  void shape(const NestedLens& lens, std::string_view style) {
    std::vector<Eigen::Vector2d> corners;
    for (const Eigen::Vector2d& p : lens.outline) corners.emplace_back(p.x(), y(p.y()));
    svg_.polygon(corners, style);
  }

  /// Half of the stroke lies under the part.
  void cut(const NestedLens& lens) {
    if (!lens.cut_out) return;
    shape(lens, "fill=\"none\" stroke=\"#9fb3c8\" stroke-linejoin=\"round\" " +
                    svg_.attribute("stroke-width", 2.0 * layout_.slot));
  }

  void part(const NestedLens& lens) {
    const Eigen::Vector2d middle = lens.box.center();
    const double room = lens.box.sizes().x();
    shape(lens, "fill=\"#fff\" stroke=\"#1a1f24\"");
    box(lens.box, "fill=\"none\" stroke=\"#7a8794\" stroke-dasharray=\"1 1\"");
    words(middle, 0.9, lens.name, room, true);
    words(middle, -0.4, "X " + number(lens.box.min().x()) + "  Y " + number(lens.box.min().y()),
          room, false);
    words(middle, -1.6, svg_.pair(lens.box.sizes(), " x "), room, false);
  }

  /// @param line  above the place, in letters. @param room  that the text has, mm.
  void words(const Eigen::Vector2d& at, double line, const std::string& text, double room,
             bool bold) {
    const auto letters = static_cast<double>(std::max<std::size_t>(1, text.size()));
    const double size = std::min(kLetters * longer_, 0.9 * room / (kLetterWidth * letters));
    svg_.text({at.x(), y(at.y()) - line * size},
              svg_.attribute("font-size", size) + " text-anchor=\"middle\"" +
                  (bold ? " font-weight=\"700\"" : ""),
              text);
  }

  void keep_out(const KeepOut& clamp) {
    const Eigen::AlignedBox2d at(Eigen::Vector2d(clamp.low.head<2>()),
                                 Eigen::Vector2d(clamp.high.head<2>()));
    box(at, "fill=\"#f2c9c9\" fill-opacity=\"0.7\" stroke=\"#a3161a\"");
    words(at.center(), 0.0, clamp.name, at.sizes().x(), false);
  }

  void dimensions() {
    const Eigen::Vector2d below(0.5 * layout_.blank.x(), 0.0);
    const std::string blank =
        "blank " + number(layout_.blank.x()) + " x " + number(layout_.blank.y()) + " x " +
        number(layout_.blank.z()) + " mm; lenses at least " + number(layout_.gap) + " mm apart" +
        (layout_.slot > 0.0 ? ", cut out with a tool of " + number(layout_.slot) + " mm"
                            : ", not cut out");
    words(below, -0.42 * margin_ / (kLetters * longer_) - 1.0, blank,
          layout_.blank.x() + 1.6 * margin_, false);
  }

  void zero() {
    const double length = 0.5 * margin_;
    const double head = 0.12 * length;
    const std::string start = "M" + svg_.pair({0.0, y(0.0)}, " ");
    const auto step = [&](const char* kind, double right, double down) {
      return kind + svg_.pair({head * right, head * down}, " ");
    };
    const std::string style =
        " stroke=\"#a3161a\" " + svg_.attribute("stroke-width", 2.0 * kLine * longer_);
    svg_.path(
        joined({start, "h", number(length), step("m", -1, -1), step("l", 1, 1), step("l", -1, 1),
                start, "v", number(-length), step("m", -1, 1), step("l", 1, -1), step("l", 1, 1)}),
        "fill=\"none\"" + style);
    svg_.circle({0.0, y(0.0)}, svg_.attribute("r", head) + " fill=\"#fff\"" + style);
    words({-0.35 * margin_, -0.2 * margin_}, 0.0, "X0 Y0", 0.6 * margin_, true);
  }

  const NestLayout& layout_;
  double longer_;
  double margin_ = 0.0;
  SvgWriter svg_{3, SvgWriter::Zeros::kTrimmed, "\n"};
};

}  // namespace

std::string nest_svg(const NestLayout& layout) { return Drawing(layout).draw(); }

namespace {

/// The job of a nest. A lens named twice is two parts.
CutJob job_of(const std::vector<NestLens>& lenses, const NestPlan& plan, const CamOptions& options,
              const fs::path& folder) {
  const Eigen::Vector3d& blank = plan.layout.blank;
  CutJob job;
  job.options = options;
  job.shared = SharedBlank{blank, options.z_zero == ZZero::kStock ? -blank.z() : 0.0};
  job.beside = {nest_file::kLayout, nest_file::kJson};
  for (std::size_t k = 0; k < lenses.size(); ++k) {
    job.parts.push_back({lenses[k].lens, plan.cuts[k], folder / lenses[k].name,
                         plan.layout.lenses[k].box.min(), lenses[k].name});
  }
  return job;
}

/// Programs in the order in which they are run, and the tools that they need.
void describe_programs(const ProgramFiles& all, NestResult& result) {
  int last = -1;
  for (const WrittenProgram& file : all.files) {
    NestProgram program{
        file.path.filename().string(), {}, file.time.seconds / 60.0, file.time.lines};
    for (const OperationTime& time : file.operations) {
      const int tool = all.summaries[time.operation].tool;
      if (program.tools.empty() || program.tools.back() != tool) program.tools.push_back(tool);
      if (tool != last) ++result.tool_changes;
      last = tool;
    }
    result.programs.push_back(std::move(program));
  }
}

/// Advice on the outlines' tool; empty if it is long enough, or none is cut.
std::string outline_advice(const std::vector<NestLens>& lenses, const NestOptions& options,
                           const NestLayout& layout, const WrittenJob& written) {
  const auto cut_out = [](const NestedLens& lens) { return lens.cut_out; };
  const auto first = std::find_if(layout.lenses.begin(), layout.lenses.end(), cut_out);
  if (first == layout.lenses.end()) return "";
  const auto part = static_cast<std::size_t>(first - layout.lenses.begin());
  const double least = std::ceil(1e3 * least_thickness(lenses, options)) / 1e3;
  const std::string thinner =
      joined({"--blank ", trimmed_decimal(layout.blank.x(), 3), ",",
              trimmed_decimal(layout.blank.y(), 3), ",", trimmed_decimal(least, 3)});
  return outline_tool_advice(written.parts[part]->setup, *written.checks, layout.blank.z(),
                             {thinner, least});
}

/// Warnings of the nest as a whole.
std::vector<std::string> warnings_of(const std::vector<NestLens>& lenses,
                                     const NestOptions& options, const NestLayout& layout,
                                     const WrittenJob& written) {
  std::vector<std::string> warnings;
  for (const NestedLens& lens : layout.lenses) {
    if (lens.cut_out) continue;
    warnings.emplace_back(joined({lens.name, ": stays joined to the blank and has to be sawn out; ",
                                  "--cut-outline always cuts it out"}));
  }
  const std::string advice = outline_advice(lenses, options, layout, written);
  if (!advice.empty()) warnings.push_back(advice);
  const Eigen::Vector3d travel = options.cam.workshop.machine.travel;
  if ((layout.blank.array() > travel.array()).any()) {
    warnings.push_back("the blank is larger than the machine's travel of " +
                       decimal_text(travel.x(), 0) + " x " + decimal_text(travel.y(), 0) + " x " +
                       decimal_text(travel.z(), 0) + " mm");
  }
  if (!written.others.kept.empty()) {
    warnings.emplace_back(
        "the folder holds programs of another job, which were kept: do not run them with it");
  }
  return warnings;
}

/// Removes reports of an earlier nest, including those of lenses that are no longer in it.
void remove_older(const fs::path& folder, const std::vector<NestLens>& lenses) {
  if (!written_by_lensforge(folder / nest_file::kJson)) return;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    if (!entry.is_directory(none) || fs::exists(entry.path() / lens_file::kJson)) continue;
    remove_prediction(entry.path());
    const bool used = std::any_of(lenses.begin(), lenses.end(), [&](const NestLens& one) {
      return one.name == entry.path().filename().string();
    });
    if (!used) fs::remove(entry.path(), none);  // If it is empty.
  }
}

/// Deletes the old reports first and publishes the new ones last.
void publish_nest(const std::vector<NestLens>& lenses, const fs::path& folder, WrittenJob& written,
                  NestResult& result) {
  PendingFiles own(folder);
  own.add(nest_file::kLayout, nest_svg(result.layout));
  constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
  own.add(nest_file::kJson, nest_json(result, false).dump(1, ' ', false, kReplace) + "\n");
  remove_older(folder, lenses);
  result.files = publish(written);
  for (const fs::path& path : own.publish()) result.files.push_back(path);
}

nlohmann::json lens_json(const NestedLens& lens, bool whole) {
  nlohmann::json json = {{"name", lens.name},
                         {"at", {lens.box.min().x(), lens.box.min().y()}},
                         {"size", {lens.box.sizes().x(), lens.box.sizes().y()}},
                         {"cut_out", lens.cut_out},
                         {"passes", lens.report.verdict.passes()}};
  if (whole) json["report"] = report_json(lens.report);
  return json;
}

}  // namespace

bool NestResult::passes() const {
  return std::all_of(layout.lenses.begin(), layout.lenses.end(),
                     [](const NestedLens& lens) { return lens.report.verdict.passes(); });
}

int NestResult::missed() const {
  int count = 0;
  for (const NestedLens& lens : layout.lenses) count += lens.report.verdict.missed();
  return count;
}

double NestResult::minutes() const {
  double sum = 0.0;
  for (const NestProgram& program : programs) sum += program.minutes;
  return sum;
}

nlohmann::json nest_json(const NestResult& result, bool reports) {
  const NestLayout& layout = result.layout;
  nlohmann::json json = {{"program", program_mark()},
                         {"blank", {layout.blank.x(), layout.blank.y(), layout.blank.z()}},
                         {"zero", "lower left corner of the blank"},
                         {"z_offset", result.z_offset},
                         {"gap", layout.gap},
                         {"edge", layout.edge},
                         {"slot", layout.slot},
                         {"minutes", result.minutes()},
                         {"tool_changes", result.tool_changes},
                         {"programs", nlohmann::json::array()},
                         {"lenses", nlohmann::json::array()}};
  for (const NestProgram& program : result.programs) {
    json["programs"].push_back({{"file", program.file},
                                {"tools", program.tools},
                                {"minutes", program.minutes},
                                {"lines", program.lines}});
  }
  for (const NestedLens& lens : layout.lenses) json["lenses"].push_back(lens_json(lens, reports));
  return json;
}

bool is_name_of_nest(const std::string& name) {
  return name == nest_file::kLayout || name == nest_file::kJson || is_name_of_cut(name);
}

void require_no_lens_folder(const std::vector<NestLens>& lenses, const fs::path& folder) {
  if (fs::exists(folder / lens_file::kJson)) {
    throw InputError("--out " + folder.string() + ": is a lens folder; name another one");
  }
  for (const NestLens& lens : lenses) {
    const fs::path own = folder / lens.name;
    if (!fs::exists(own / lens_file::kJson)) continue;
    throw InputError("--out " + folder.string() + ": the reports of " + lens.name +
                     " would come into the lens folder " + own.string() + "; name another folder");
  }
}

NestResult make_nest(const std::vector<NestLens>& lenses, const NestOptions& options,
                     const fs::path& folder, const Executor& executor, const RunControl& control) {
  NestResult result;
  try {
    NestPlan plan = plan_nest(lenses, options);
    require_no_lens_folder(lenses, folder);
    const CutJob job = job_of(lenses, plan, options.cam, folder);
    WrittenJob written = write_job(job, folder, executor, control);
    result.layout = std::move(plan.layout);
    result.warnings = warnings_of(lenses, options, result.layout, written);
    for (std::size_t k = 0; k < lenses.size(); ++k) {
      result.layout.lenses[k].report = std::move(written.reports[k]);
    }
    result.z_offset = written.parts.front()->setup.z_offset;
    describe_programs(written.programs->programs(), result);
    result.message = verdict_words(result.missed(), result.passes() ? 0 : 1);
    publish_nest(lenses, folder, written, result);
    return result;
  } catch (const Interrupted&) {
    result.interrupt();
    return result;
  }
}

}  // namespace lensforge
