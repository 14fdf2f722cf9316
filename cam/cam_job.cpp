// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/cam_job.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <fstream>
#include <system_error>
#include <utility>

#include "cam/contact/cut_surface.h"
#include "cam/contact/height_field.h"
#include "cam/path/finish_raster.h"
#include "core/decimal_text.h"
#include "core/error.h"
#include "core/files.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Comment lines that are known only after the last row: depth and length of the program.
constexpr int kLateComments = 2;

/// Lines per second that an 8-bit Grbl board takes in.
constexpr double kGrblLinesPerSecond = 400.0;

/// Ends the writing of a file that nobody wants any more.
struct Stopped {};

double resolution_of(const CamOptions& options) { return std::pow(10.0, -options.decimals); }

double z_offset_of(const CamOptions& options, double surface_top) {
  switch (options.z_zero) {
    case ZZero::kStock:
      return -(surface_top + options.stock);
    case ZZero::kLens:
      return -surface_top;
    case ZZero::kTable:
      break;
  }
  return 0.0;
}

const char* z_zero_words(ZZero zero) {
  switch (zero) {
    case ZZero::kStock:
      return "top of the blank";
    case ZZero::kLens:
      return "highest point of the finished lens";
    case ZZero::kTable:
      break;
  }
  return "flat face that the blank lies on";
}

GcodeOptions gcode_options(const CamOptions& options, const CamResult& result) {
  GcodeOptions gcode;
  gcode.post = options.post;
  gcode.decimals = options.decimals;
  gcode.spindle_rpm = options.spindle_rpm;
  gcode.spin_up = options.spin_up;
  gcode.feed = options.feed;
  gcode.plunge = options.plunge;
  gcode.blend_tolerance = options.tolerance;
  gcode.safe_z = result.stock_top + options.safe_height + result.z_offset;
  return gcode;
}

std::vector<std::string> head_comments(const CamOptions& options, const RasterPlan& plan,
                                       const CamResult& result) {
  const Eigen::Vector2d low = plan.surface.min().array() - plan.radius;
  const Eigen::Vector2d high = plan.surface.max().array() + plan.radius;
  const int d = options.decimals;
  return {"job: " + options.job.substr(0, 60),
          "lensforge " LENSFORGE_VERSION ", post " + std::string(post_name(options.post)),
          "operation: finish, " + std::to_string(plan.rows) + " rows along X, stepover " +
              decimal_text(plan.pitch, 5) + " mm",
          "units: mm; X0 Y0: lower left corner of the lens",
          "Z0: " + std::string(z_zero_words(options.z_zero)),
          "top of the blank: Z " + decimal_text(result.stock_top + result.z_offset, d),
          "T1: ball-end mill, diameter " + decimal_text(options.tool_diameter, 3) + " mm",
          "spindle " + decimal_text(options.spindle_rpm, 0) + " rpm, feed " +
              decimal_text(options.feed, 0) + ", plunge " + decimal_text(options.plunge, 0) +
              " mm/min",
          "X " + decimal_text(low.x(), d) + " to " + decimal_text(high.x(), d) + ", Y " +
              decimal_text(plan.row_place(0), d) + " to " +
              decimal_text(plan.row_place(plan.rows - 1), d)};
}

std::vector<std::string> late_comments(const CamOptions& options, const CamResult& result) {
  return {"Z " + decimal_text(result.tip.min().z() + result.z_offset, options.decimals) + " to " +
              decimal_text(result.tip.max().z() + result.z_offset, options.decimals) +
              " while cutting",
          std::to_string(result.lines) + " lines, cutting length " +
              decimal_text(result.cutting_length, 0) + " mm"};
}

void take_summary(const RasterSummary& summary, const CamOptions& options, CamResult& result) {
  result.rows = summary.rows;
  result.points = summary.points;
  result.cutting_length = summary.length;
  result.length_over_feed_min = summary.length / options.feed;
  result.tip = summary.tip;
  result.deepest_cut = std::fmax(0.0, result.stock_top - summary.tip.min().z());
}

[[noreturn]] void fail_to_write(const fs::path& path, int error) {
  throw RunError(path.string() + ": cannot be written: " +
                 std::generic_category().message(error != 0 ? error : EIO));
}

/// The program on its way into a file: rows in, G-code out.
class FinishProgram {
 public:
  FinishProgram(const fs::path& beside, const fs::path& named_in_error, const GcodeOptions& gcode,
                double z_offset)
      : path_(named_in_error),
        file_(beside, std::ios::binary | std::ios::trunc),
        writer_(file_, gcode),
        lift_(0.0, 0.0, z_offset) {
    check();
  }

  void begin(const std::vector<std::string>& comments) { writer_.begin(comments, kLateComments); }

  void add(const RasterRow& row) {
    if (cutting_) {
      writer_.cut_to(row.start + lift_);
    } else {
      writer_.plunge_to(row.start + lift_);
    }
    cutting_ = true;
    for (const PathMove& move : row.moves) writer_.cut_to(move.end + lift_);
    check();
  }

  std::int64_t end() {
    writer_.end();
    return writer_.lines();
  }

  void close(const std::vector<std::string>& late) {
    writer_.fill_in(late);
    file_.close();
    check();
  }

 private:
  void check() {
    if (!file_) fail_to_write(path_, errno);
  }

  fs::path path_;
  std::ofstream file_;
  GcodeWriter writer_;
  Eigen::Vector3d lift_;
  bool cutting_ = false;
};

/// Everything that a run needs beside its options.
struct Job {
  const CamOptions& options;
  const CutSurface& surface;
  const RasterPlan& plan;
  const Executor& executor;
  const RunControl& control;
};

/// Cuts the raster into `path`. @throw Stopped if the caller wants no more; the file is then not
/// made.
void write_program(const Job& job, const fs::path& path, CamResult& result) {
  write_whole_file(path, [&](const fs::path& beside) {
    FinishProgram program(beside, path, gcode_options(job.options, result), result.z_offset);
    program.begin(head_comments(job.options, job.plan, result));
    const auto sink = [&](const RasterRow& row) { program.add(row); };
    const RasterSummary summary =
        cut_raster(job.surface, job.plan, job.executor, sink, job.control);
    if (!summary.complete) throw Stopped{};
    take_summary(summary, job.options, result);
    result.lines = program.end();
    program.close(late_comments(job.options, result));
  });
}

void warn_of_depth(const CamOptions& options, CamResult& result) {
  if (result.deepest_cut <= 0.5 * options.tool_diameter) return;
  result.warnings.push_back("this program removes up to " + decimal_text(result.deepest_cut, 2) +
                            " mm in one pass of a " + decimal_text(options.tool_diameter, 2) +
                            " mm tool: rough the blank to the surface first");
}

void warn_of_slope(const HeightField& field, CamResult& result) {
  if (field.steepest <= kSteepestSlope) return;
  const Eigen::Vector3d& at = field.steepest_place;
  result.warnings.push_back("the surface rises by " + decimal_text(field.steepest, 2) +
                            " mm a millimetre at x " + decimal_text(at.x(), 2) + " y " +
                            decimal_text(at.y(), 2) +
                            ": on slopes above 1 the path may run farther than the tolerance "
                            "from the exact one, and a steep rim may be left uncut");
}

void warn_of_decimals(const CamOptions& options, CamResult& result) {
  const double move =
      result.cutting_length / static_cast<double>(std::max<std::int64_t>(1, result.points - 1));
  const double error = resolution_of(options) / move;
  if (error <= options.slope_tolerance || options.decimals >= 6) return;
  result.warnings.push_back(
      "moves are " + decimal_text(move, 4) + " mm long on average, so rounding to " +
      std::to_string(options.decimals) + " decimals turns them by up to " +
      decimal_text(1e3 * error, 1) + " mrad, more than the slope tolerance: use more decimals");
}

void warn_of_grbl(const CamOptions& options, CamResult& result) {
  if (options.post != Post::kGrbl) return;
  result.warnings.push_back(
      "Grbl runs the spindle no faster than its setting $30, silently: $30 "
      "has to be at least " +
      decimal_text(options.spindle_rpm, 0));
  const double rate = static_cast<double>(result.lines) / (60.0 * result.length_over_feed_min);
  if (rate <= kGrblLinesPerSecond) return;
  result.warnings.push_back("at this feed the program needs " + decimal_text(rate, 0) +
                            " lines a second; an 8-bit Grbl board takes about " +
                            decimal_text(kGrblLinesPerSecond, 0));
}

RasterPlan plan_for(const CamOptions& options, const HeightField& field) {
  const Eigen::AlignedBox2d surface(field.box.min().head<2>(), field.box.max().head<2>());
  RasterOptions raster{options.pitch, options.tolerance, options.slope_tolerance,
                       resolution_of(options)};
  raster.z_zero = -z_offset_of(options, field.box.max().z());
  return plan_finish_raster(surface, 0.5 * options.tool_diameter, raster);
}

CamResult start_result(const CamOptions& options, const HeightField& field,
                       const RasterPlan& plan) {
  CamResult result;
  result.surface_top = field.box.max().z();
  result.stock_top = result.surface_top + options.stock;
  result.z_offset = z_offset_of(options, result.surface_top);
  result.pitch = plan.pitch;
  return result;
}

}  // namespace

CamResult make_finish_program(const Lens& lens, const CamOptions& options, const fs::path& folder,
                              const Executor& executor, const RunControl& control) {
  const auto start = std::chrono::steady_clock::now();
  validate(options, lens.setup);
  const HeightField field = inspect_height_field(lens.surface, lens.setup.lens_size);
  require_writable_folder(folder);
  const RasterPlan plan = plan_for(options, field);
  CamResult result = start_result(options, field, plan);
  const FacetSurface surface(lens.surface, plan.radius, executor);
  try {
    write_program({options, surface, plan, executor, control}, folder / cam_file::kFinish, result);
  } catch (const Stopped&) {
    result.status = CamResult::Status::kInterrupted;
    result.message = "interrupted; no program was written";
    return result;
  }
  warn_of_depth(options, result);
  warn_of_slope(field, result);
  warn_of_decimals(options, result);
  warn_of_grbl(options, result);
  result.status = CamResult::Status::kDone;
  result.message = "finishing program of " + std::to_string(result.rows) + " rows and " +
                   std::to_string(result.points) + " points";
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  result.seconds = elapsed.count();
  result.files = {folder / cam_file::kFinish, folder / cam_file::kReport};
  write_whole_file(folder / cam_file::kReport, cam_report(options, result).dump(2) + "\n");
  return result;
}

}  // namespace lensforge
