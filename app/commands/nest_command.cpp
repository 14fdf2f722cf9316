// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/commands/nest_command.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "app/commands/cam_command.h"
#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/frame/console.h"
#include "app/frame/option_set.h"
#include "cam/cam.h"
#include "cam/plan/cam_options.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/text/number_text.h"
#include "core/text/read_numbers.h"

namespace lensforge::app {
namespace {

constexpr const char* kBlank = "--blank";

/// A gap beyond it is none, mm.
constexpr double kWidestGap = 1000.0;

std::string blank_text(const NestOptions& options) {
  std::vector<double> numbers(options.blank.data(), options.blank.data() + 2);
  if (options.thickness) numbers.push_back(*options.thickness);
  return options.blank.isZero() ? "" : numbers_text(numbers);
}

void set_blank(NestOptions& options, const std::string& text) {
  const auto commas = std::count(text.begin(), text.end(), ',');
  const std::vector<double> numbers = parse_numbers(text, kBlank, commas == 2 ? 3 : 2);
  options.blank = {numbers[0], numbers[1]};
  options.thickness.reset();
  if (numbers.size() > 2) options.thickness = numbers[2];
}

void describe_sheet(Description& d, NestOptions& options) {
  d.text(
      {.name = kBlank,
       .help = "width and height of the common blank, and its thickness where it is more than "
               "the highest lens needs, mm",
       .unit = "W,H[,T]"},
      [&options] { return blank_text(options); },
      [&options](const std::string& text) { set_blank(options, text); });
  d.length("--gap", options.gap, Limits::between(0, kWidestGap),
           "between lenses, at least; 0: the least that the tools need");
}

}  // namespace

void describe(Description& d, NestSettings& settings) {
  d.texts("DIR", settings.sources, "", "lens folders; one named twice is cut twice");
  d.text("--out", settings.out, "DIR",
         "folder for programs, layout and a folder of reports of each lens")
      .needed = true;
  describe_sheet(d, settings.nest);
  d.text("--workshop", settings.workshop, "FILE.toml",
         "machine, blank, clamps, tools and process; options given here win");
  describe(d, settings.nest.cam);
}

void settle(OptionSet& options, NestSettings& settings) {
  take_workshop(options, settings.workshop, settings.nest.cam);
  if (settings.sources.empty()) {
    throw InputError("DIR: is required; name the lens folders, such as nest bee disc");
  }
  if (!options.given(kBlank)) throw InputError("--blank: is required; such as --blank 300,200");
  settings.nest.cam.job = folder_name(settings.out);
  check_workshop(settings.workshop, settings.nest.cam);
}

std::vector<std::string> nest_names(const std::vector<std::string>& sources) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const std::string& source : sources) {
    const std::string name = folder_name(source);
    std::string unique = name;
    for (int number = 2; !taken.insert(unique).second; ++number) {
      unique = name;
      unique.append("_").append(std::to_string(number));
    }
    names.push_back(unique);
  }
  return names;
}

namespace {

namespace fs = std::filesystem;

/// Every folder once, however often it is named; none is written to while the nest is made.
class Sources {
 public:
  explicit Sources(const NestSettings& settings) : names_(nest_names(settings.sources)) {
    for (const std::string& source : settings.sources) {
      if (is_folder(source) && !lenses_.contains(source)) {
        locks_.emplace_back(source, FolderLock::Kind::kShared);
      }
      if (!lenses_.contains(source)) lenses_.emplace(source, read_lens(source));
      order_.push_back(source);
    }
  }

  [[nodiscard]] std::vector<NestLens> lenses() const {
    std::vector<NestLens> all;
    for (std::size_t k = 0; k < order_.size(); ++k) {
      all.push_back({names_[k], &lenses_.at(order_[k])});
    }
    return all;
  }
  [[nodiscard]] const std::string& folder(std::size_t k) const { return order_[k]; }
  void note_unfinished(const Console& console) const {
    for (const auto& [source, lens] : lenses_) note_unfinished_design(lens, console);
  }

 private:
  std::vector<std::string> names_;
  std::vector<std::string> order_;
  std::vector<FolderLock> locks_;
  std::map<std::string, Lens> lenses_;
};

std::string place_text(const NestedLens& lens) {
  const Eigen::Vector2d at = lens.box.min();
  std::string text =
      "  " + lens.name + " at X " + trimmed_decimal(at.x(), 2) + " Y " + trimmed_decimal(at.y(), 2);
  if (!lens.report.leakage.steps.empty()) {
    const PictureQuality& part = lens.report.judged().part().quality;
    text += ": " + metrics_text(part.metrics) + ", leaks " + fixed(100.0 * part.leakage, 2) + " %";
  }
  return text + (lens.cut_out ? "\n" : ", stays joined\n");
}

std::string summary_text(const fs::path& folder, const NestResult& result) {
  if (!result.done()) return result.message + "\n";
  const NestLayout& layout = result.layout;
  std::string text = folder.string() + ": " + result.message + "\n  blank     " +
                     trimmed_decimal(layout.blank.x(), 2) + " x " +
                     trimmed_decimal(layout.blank.y(), 2) + " x " +
                     trimmed_decimal(layout.blank.z(), 3) +
                     " mm, X0 Y0 in its lower left corner; lenses at least " +
                     trimmed_decimal(layout.gap, 2) + " mm apart\n";
  for (const NestedLens& lens : layout.lenses) {
    text += place_text(lens) + verdict_text(lens.report.verdict);
  }
  for (const NestProgram& program : result.programs) {
    text += "  " + program.file + ", " + std::to_string(program.lines) + " moves, " +
            fixed(program.minutes, 1) + " min\n";
  }
  return text + "  in all    " + fixed(result.minutes(), 1) + " min, " +
         std::to_string(result.tool_changes) + " tools put in\n" + z_text(result.z_offset);
}

nlohmann::json summary_json(const OptionSet& options, const NestResult& result,
                            const Sources& sources) {
  nlohmann::json json = job_json(options, result, result.warnings);
  if (!result.done()) return json;
  json.update(nest_json(result, true));
  for (std::size_t k = 0; k < json["lenses"].size(); ++k) {
    json["lenses"][k]["folder"] = sources.folder(k);
  }
  return json;
}

/// Warnings that are in every lens's report, such as collisions on the common blank, only once.
std::vector<std::string> warnings_of(const NestResult& result) {
  std::vector<std::string> warnings = result.warnings;
  const std::vector<NestedLens>& lenses = result.layout.lenses;
  for (const NestedLens& lens : lenses) {
    for (const std::string& warning : lens.report.warnings) {
      const bool common = std::all_of(lenses.begin(), lenses.end(), [&](const NestedLens& other) {
        const std::vector<std::string>& all = other.report.warnings;
        return std::find(all.begin(), all.end(), warning) != all.end();
      });
      if (!common) warnings.push_back(lens.name + ": " + warning);
      if (common && &lens == &lenses.front()) warnings.push_back(warning);
    }
  }
  return warnings;
}

CommandResult run(CommandFrame& frame, NestSettings& settings) {
  OptionSet& options = frame.options();
  settle(options, settings);
  const Sources sources(settings);
  const std::vector<NestLens> lenses = sources.lenses();
  sources.note_unfinished(frame.console());
  const NestPlan plan = plan_nest(lenses, settings.nest);
  require_no_lens_folder(lenses, settings.out);
  const WorkEstimate estimate = estimate_nest(plan, lenses, options.executor().concurrency());
  require_room_for_cut(plan.cuts.front(), lenses.front().lens->setup, estimate, settings.out);
  frame.begin_folder(settings.out).remove_partial_files(is_name_of_nest);
  announce_work(estimate, frame.console(), "the cuts take");
  const NestResult result =
      make_nest(lenses, settings.nest, settings.out, frame.executor(), frame.control());
  CommandResult outcome{summary_json(options, result, sources), summary_text(settings.out, result),
                        exit_code(result.done(), result.missed() == 0), warnings_of(result)};
  if (result.done()) {
    outcome.notes.push_back(next_step(fs::path(settings.out) / nest_file::kLayout, result,
                                      settings.nest.cam, result.missed()));
  }
  return outcome;
}

Command<NestSettings> command() {
  return {
      "nest",
      "Makes programs that mill several lenses of one blank with one zero, and predicts what each "
      "will project.",
      run};
}

}  // namespace

int nest_command(const Arguments& arguments) { return run_command(command(), arguments); }

CommandCall nest_call() { return call_of(command(), NestSettings()); }

}  // namespace lensforge::app
