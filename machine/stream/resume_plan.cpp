// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/resume_plan.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/text/number_text.h"
#include "machine/stream/entry_lines.h"

namespace lensforge {
namespace {

/// Coordinate systems are told with three decimals, mm.
constexpr double kOriginTolerance = 0.0015;

/// A move that goes less than this part of its height across is a plunge or a retract.
constexpr double kMinShareAcross = 0.1;

/// Motions kept to choose the entry among.
constexpr std::size_t kHistory = 4096;

/// One line that was carried out: what was in force before it, and what it moved.
struct Done {
  std::int64_t line = 0;
  std::int64_t offset = 0;
  GcodeState before;
  GcodeState after;
  std::vector<GcodeMotion> motions;
  [[nodiscard]] bool cuts() const {
    return !motions.empty() && std::none_of(motions.begin(), motions.end(),
                                            [](const GcodeMotion& m) { return m.rapid; });
  }
  /// A cut along which a tool can come down: none straight down or up.
  [[nodiscard]] bool leads_along() const {
    return cuts() && std::all_of(motions.begin(), motions.end(), [](const GcodeMotion& m) {
             const Eigen::Vector3d step = m.end - m.start;
             return m.arc || step.head<2>().norm() >= kMinShareAcross * std::abs(step.z());
           });
  }
};

/// The lines up to `last`, the newest kHistory of them that move; and where the next one begins.
struct History {
  std::deque<Done> lines;
  GcodeState state;
  std::int64_t next_line = 1;
  std::int64_t next_offset = 0;
};

History read_history(std::istream& program, std::int64_t last, const ControllerInfo& info) {
  GcodeReader reader(program);
  GcodeInterpreter interpreter(info.dialect, info.start);
  History history;
  while (history.next_line <= last && !interpreter.ended()) {
    const std::optional<GcodeText> text = reader.next();
    if (!text) break;
    Done done{text->line, text->offset, interpreter.state(), {}, {}};
    const GcodeEffect effect = interpreter.run(parse_gcode_block(*text));
    done.after = interpreter.state();
    done.motions.assign(effect.motions().begin(), effect.motions().end());
    history.next_line = text->line + 1;
    history.next_offset = text->next_offset;
    if (done.motions.empty()) continue;
    history.lines.push_back(std::move(done));
    if (history.lines.size() > kHistory) history.lines.pop_front();
  }
  history.state = interpreter.state();
  return history;
}

/// The cuts right before the end of the history, long enough to come down along, as the path that
/// they make; empty if there is no such path.
std::vector<GcodeMotion> ramp_path(const History& history, double length) {
  std::vector<GcodeMotion> path;
  double found = 0.0;
  for (auto at = history.lines.rbegin(); at != history.lines.rend() && found < length; ++at) {
    const bool same_frame = at->after.coordinate_system == history.state.coordinate_system &&
                            spindle_order(at->after) == spindle_order(history.state) &&
                            at->after.tool == history.state.tool;
    if (!at->leads_along() || !same_frame) return {};
    path.insert(path.begin(), at->motions.begin(), at->motions.end());
    for (const GcodeMotion& motion : at->motions) found += motion.length();
  }
  if (found < length) return {};
  return path;
}

/// Back to before the run of cuts at the end: its own approach leads into it.
void go_back_to_approach(History& history) {
  while (!history.lines.empty() && history.lines.back().cuts()) {
    const Done& last = history.lines.back();
    history.state = last.before;
    history.next_line = last.line;
    history.next_offset = last.offset;
    history.lines.pop_back();
  }
}

void require_same_place(const JournalRecord& record, const ControllerInfo& info) {
  if (!record.origins) return;
  const auto origins = info.start.tool_origins();
  for (std::size_t i = 0; i < origins.size(); ++i) {
    const Eigen::Vector3d was = record.origins->at(i);
    const Eigen::Vector3d is = origins.at(i);
    if ((was - is).cwiseAbs().maxCoeff() <= kOriginTolerance) continue;
    throw InputError("G" + std::to_string(54 + i) + " began at " + point_text(was) +
                     " when the job was begun and begins at " + point_text(is) +
                     " now: the part would be cut at another place");
  }
}

/// The way in has to begin below where the tool stands: nothing is known of what is above that.
void require_below_retract(const Entry& entry) {
  if (entry.path.empty()) return;
  const double retract = entry.info.start.position.z();
  for (const Eigen::Vector3d& at :
       ramp_points(entry.path, entry.options.ramp, entry.options.lift)) {
    if (at.z() <= retract) continue;
    throw InputError("lift " + trimmed_decimal(entry.options.lift, 3) +
                     " mm: the tool would start at machine Z" + trimmed_decimal(at.z(), 3) +
                     ", above the retract height Z" + trimmed_decimal(retract, 3) +
                     "; use a lower lift");
  }
}

}  // namespace

ResumePlan plan_resume(std::istream& program, const JournalRecord& record,
                       const ControllerInfo& info, const ProgramFacts& facts,
                       const ResumeOptions& options) {
  if (record.finished) throw InputError("the job was finished; nothing to resume");
  require_same_place(record, info);
  const std::int64_t last = std::max<std::int64_t>(record.last.executed - options.margin, 0);
  History history = read_history(program, last, info);
  std::vector<GcodeMotion> path = ramp_path(history, options.ramp);
  if (path.empty()) go_back_to_approach(history);
  ResumePlan plan;
  plan.line = history.next_line;
  plan.offset = history.next_offset;
  plan.state = history.state;
  plan.entry_line = path.empty() ? plan.line : path.front().line;
  plan.overlap_end = std::max(record.last.sent, plan.line - 1);
  if (plan.line == 1) {
    plan.steps = {"nothing was certainly carried out: the program runs from its first line"};
    return plan;
  }
  const Entry entry{path, history.state, info, facts, options};
  require_below_retract(entry);
  plan.before = entry_lines(entry, plan.line - 1, plan.offset);
  plan.steps = entry_steps(entry);
  plan.steps.push_back("run the program from line " + std::to_string(plan.line) + " on; lines " +
                       std::to_string(plan.entry_line) + " to " + std::to_string(plan.overlap_end) +
                       " may be cut twice");
  return plan;
}

}  // namespace lensforge
