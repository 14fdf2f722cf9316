// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon_job.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>

#include "cam/coupon/coupon_sheet.h"
#include "cam/job/job_files.h"
#include "cam/path/finish_raster.h"
#include "cam/path/rough_passes.h"
#include "cam/post/program_part.h"
#include "cam/post/program_reader.h"
#include "cam/post/program_writer.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/schema/toml.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

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
       {std::to_string(layout_.pads.size()) + " pads, " + std::to_string(layout_.grooves.size()) +
        " grooves, 2 marks " + trimmed_decimal(layout_.mark_distance(), 3) + " mm apart"},
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

}  // namespace lensforge
