// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <utility>

#include "cam/cam.h"
#include "cam/job/cut_job.h"
#include "cam/job/cut_report.h"
#include "cam/job/job_files.h"
#include "cam/job/nest_plan.h"
#include "cam/post/program_writer.h"
#include "cam/report/report_json.h"
#include "core/error.h"
#include "core/io/lens_folder.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/version.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

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

/// @throw InputError naming a lens folder in which the nest's files would come.
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
    warnings.push_back(lens.name +
                       ": stays joined to the blank and has to be sawn out; --cut-outline "
                       "always cuts it out");
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
    warnings.push_back(
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
