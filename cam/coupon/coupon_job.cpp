// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon_job.h"

#include <array>
#include <system_error>

#include "cam/coupon/coupon_plan.h"
#include "cam/coupon/coupon_sheet.h"
#include "cam/job/job_files.h"
#include "cam/post/program_part.h"
#include "cam/post/program_writer.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/pending_files.h"
#include "core/text/toml_fields.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

constexpr double kSecondsPerMinute = 60.0;

/// Whether it can be read as readings and has none.
bool holds_no_readings(const fs::path& file) {
  try {
    return parse_readings(read_toml_file(file, "a file of readings"), file.string()).count() == 0;
  } catch (const InputError&) {
    return false;
  }
}

/// A day's work at the bench is not written over.
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
  for (const ProgramFile& file : programs.files) {
    sheet.files += (sheet.files.empty() ? "" : ", ") + file.path.filename().string();
  }
  sheet.minutes = programs.total.seconds / kSecondsPerMinute;
  sheet.thickness = options.thickness;
  sheet.warnings = plan.faults();
  return sheet;
}

/// Programs of an earlier coupon in another dialect, which the sheet is not about.
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
  for (const ProgramFile& file : programs.programs().files) result.files.push_back(file.path);
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
