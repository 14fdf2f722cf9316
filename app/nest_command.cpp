// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "app/cam_output.h"
#include "app/commands.h"
#include "app/console.h"
#include "app/exit_code.h"
#include "app/interrupt.h"
#include "app/interruptible_job.h"
#include "app/json_output.h"
#include "app/lens_note.h"
#include "app/nest_settings.h"
#include "app/option_set.h"
#include "app/output_folder.h"
#include "app/progress_display.h"
#include "cam/cam.h"
#include "core/io/files.h"
#include "core/io/folder_lock.h"
#include "core/text/number_text.h"

namespace lensforge::app {
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
    const PictureQuality& part = lens.report.leakage.part().quality;
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
         std::to_string(result.tool_changes) + " tools put in\n" +
         "  Z         program Z = lens z + " + fixed(result.z_offset, 4) + " mm\n";
}

nlohmann::json summary_json(const OptionSet& options, const NestResult& result,
                            const Sources& sources) {
  nlohmann::json json = {
      {"command", "nest"},         {"status", result.done() ? "done" : "interrupted"},
      {"message", result.message}, {"warnings", result.warnings},
      {"options", options.used()}, {"files", nlohmann::json::array()}};
  for (const fs::path& file : result.files) json["files"].push_back(file.string());
  if (!result.done()) return json;
  json.update(nest_json(result, true));
  for (std::size_t k = 0; k < json["lenses"].size(); ++k) {
    json["lenses"][k]["folder"] = sources.folder(k);
  }
  return json;
}

NestResult run(const OptionSet& options, const NestSettings& settings,
               const std::vector<NestLens>& lenses, const Console& console) {
  const Executor executor = options.executor();
  const NestPlan plan = plan_nest(lenses, settings.nest);
  const WorkEstimate estimate = estimate_nest(plan, lenses, executor.concurrency());
  require_room_for_cut(plan.cuts.front(), lenses.front().lens->setup, estimate, settings.out);
  const InterruptWatch interrupt;
  const OutputFolder folder(settings.out, FolderLock::Kind::kExclusive);
  folder.remove_partial_files(is_name_of_nest);
  announce_work(estimate, console, "the cuts take");
  ProgressDisplay progress(options.common().quiet);
  const RunControl control(interrupt.token(), progress.sink());
  return make_nest(lenses, settings.nest, folder.path(), executor, control);
}

int exit_code(const NestResult& result) {
  if (!result.done()) return kInterrupted;
  return result.missed() == 0 ? kDone : kLimitMissed;
}

/// What stands in every lens's report, as collisions on the common blank do, once.
void note_warnings(const NestResult& result, const Console& console) {
  for (const std::string& warning : result.warnings) console.note("warning: " + warning);
  const std::vector<NestedLens>& lenses = result.layout.lenses;
  for (const NestedLens& lens : lenses) {
    for (const std::string& warning : lens.report.warnings) {
      const bool common = std::all_of(lenses.begin(), lenses.end(), [&](const NestedLens& other) {
        const std::vector<std::string>& all = other.report.warnings;
        return std::find(all.begin(), all.end(), warning) != all.end();
      });
      if (!common) console.note("warning: " + lens.name + ": " + warning);
      if (common && &lens == &lenses.front()) console.note("warning: " + warning);
    }
  }
}

}  // namespace

int nest_command(const Arguments& command_line) {
  NestSettings settings;
  OptionSet options("nest",
                    "Makes programs that mill several lenses of one blank with one zero, and "
                    "predicts what each will project.");
  add_nest_options(options, settings);
  options.parse(command_line);
  settle(options, settings);
  const Console console(options.common().json, options.common().quiet);
  const Sources sources(settings);
  const std::vector<NestLens> lenses = sources.lenses();
  sources.note_unfinished(console);
  const NestResult result = run(options, settings, lenses, console);
  note_warnings(result, console);
  console.result(summary_json(options, result, sources), summary_text(settings.out, result));
  return exit_code(result);
}

}  // namespace lensforge::app
