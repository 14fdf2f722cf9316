// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/resume_plan.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Distance of the points on a ramp, mm: the parabola differs from its chords by less than 0.4 µm
/// for a lift of 0.3 mm over 2 mm.
constexpr double kPointDistance = 0.1;

/// Maximum rounding difference of equal heights, mm.
constexpr double kSameHeight = 1e-4;

/// Builds the lines one after another, in the program's unit and work coordinates.
class EntryWriter {
 public:
  EntryWriter(const PathEntry& entry, std::int64_t line, std::int64_t offset)
      : entry_(entry), inches_(entry.state.inches.value_or(false)), line_(line), offset_(offset) {}

  std::deque<OutgoingLine> write() {
    modes();
    up();
    spindle();
    coolant();
    const std::vector<Eigen::Vector3d> points = targets();
    add("G0" + word('X', points.front().x() - origin().x()) +
        word('Y', points.front().y() - origin().y()));
    down_to(points.front().z());
    const std::string feed = word('F', ramp_feed());
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Eigen::Vector3d at = points[i] - origin();
      add("G1" + word('X', at.x()) + word('Y', at.y()) + word('Z', at.z()) +
          (i == 1 ? feed : std::string()))
          .cuts = true;
    }
    program_modes();
    return lines_;
  }

  [[nodiscard]] std::vector<Eigen::Vector3d> targets() const {
    if (entry_.path.empty()) return {entry_.state.position};
    return ramp_points(entry_.path, entry_.options.ramp, entry_.options.lift);
  }

  /// End of the rapid descent, machine Z: the height of the program's own rapids, limited to
  /// between the target and the retract height.
  [[nodiscard]] double clear_z(double target) const {
    return std::max(std::min(entry_.facts.rapid_z, retract_z()), target);
  }

  [[nodiscard]] double retract_z() const { return entry_.info.start.position.z(); }

  [[nodiscard]] double plunge_feed() const {
    return entry_.facts.plunge_feed.value_or(entry_.options.plunge_feed);
  }

 private:
  [[nodiscard]] Eigen::Vector3d origin() const { return entry_.state.origin(); }

  [[nodiscard]] std::string word(char letter, double value) const {
    std::string text(1, letter);
    return text.append(inches_ ? trimmed_decimal(value / kMillimetresPerInch, 6)
                               : trimmed_decimal(value, 5));
  }

  OutgoingLine& add(const std::string& text) {
    OutgoingLine& line = lines_.emplace_back();
    line.text = text;
    line.line = line_;
    line.next_offset = offset_;
    return line;
  }

  void modes() {
    add(std::string(inches_ ? "G20" : "G21") + "G90G94G17");
    add(std::string("G").append(std::to_string(54 + entry_.state.coordinate_system))).alone = true;
    const double length = entry_.state.stated_length;
    if (length != 0.0) {
      add("G43.1" + word('Z', length));
    } else if (entry_.info.start.stated_length != 0.0) {
      add("G49");
    }
  }

  void up() { add("G53G0" + word('Z', retract_z())).travel = retract_z(); }

  void spindle() {
    const SpindleOrder order = spindle_order(entry_.state);
    if (!order.turning()) return;
    const bool clockwise = order.turn == SpindleTurn::kClockwise;
    OutgoingLine& line = add("S" + trimmed_decimal(order.rpm, 3) + (clockwise ? "M3" : "M4"));
    line.spindle = order;
    line.barrier = true;
  }

  void coolant() {
    if (entry_.state.mist) add("M7");
    if (entry_.state.flood) add("M8");
  }

  void down_to(double z) {
    const double clear = clear_z(z);
    if (clear < retract_z() - kSameHeight) add("G0" + word('Z', clear - origin().z()));
    if (z >= clear - kSameHeight) return;
    add("G1" + word('Z', z - origin().z()) + word('F', plunge_feed())).cuts = true;
  }

  /// The program's own feed, which stays in force after it.
  [[nodiscard]] double ramp_feed() const {
    if (entry_.state.feed) return *entry_.state.feed;
    return entry_.path.empty() ? plunge_feed() : entry_.path.back().feed;
  }

  void program_modes() {
    const GcodeState& state = entry_.state;
    if (entry_.path.empty() && state.feed) add(word('F', *state.feed));
    if (state.plane == ArcPlane::kZX) add("G18");
    if (state.plane == ArcPlane::kYZ) add("G19");
    if (!state.absolute) add("G91");
    if (state.inverse_time) add("G93");
  }

  const PathEntry& entry_;
  bool inches_;
  std::int64_t line_;
  std::int64_t offset_;
  std::deque<OutgoingLine> lines_;
};

/// Point of a motion after the share `part` of it.
Eigen::Vector3d point_of(const GcodeMotion& motion, double part) {
  if (motion.arc) return motion.arc->at(part);
  return motion.start + part * (motion.end - motion.start);
}

}  // namespace

std::vector<Eigen::Vector3d> ramp_points(const std::vector<GcodeMotion>& path, double length,
                                         double lift) {
  double whole = 0.0;
  for (const GcodeMotion& motion : path) whole += motion.length();
  const double begin = std::max(whole - length, 0.0);
  const double ramp = whole - begin;
  std::vector<Eigen::Vector3d> points;
  const auto add = [&](const GcodeMotion& motion, double part, double along) {
    const double left = std::clamp(1.0 - (along - begin) / ramp, 0.0, 1.0);
    points.emplace_back(point_of(motion, part) + Eigen::Vector3d(0.0, 0.0, lift * left * left));
  };
  double before = 0.0;
  for (const GcodeMotion& motion : path) {
    const double own = motion.length();
    const double from = std::max(begin - before, 0.0);
    if (own <= 0.0 || from >= own) {
      before += own;
      continue;
    }
    if (points.empty()) add(motion, from / own, before + from);
    const int pieces = std::max(1, static_cast<int>(std::ceil((own - from) / kPointDistance)));
    for (int i = 1; i <= pieces; ++i) {
      const double at = i == pieces ? own : from + (own - from) * i / pieces;
      add(motion, at / own, before + at);
    }
    before += own;
  }
  return points;
}

std::string point_text(const Eigen::Vector3d& point) {
  std::string text = "X";
  return text.append(trimmed_decimal(point.x(), 3))
      .append(" Y")
      .append(trimmed_decimal(point.y(), 3))
      .append(" Z")
      .append(trimmed_decimal(point.z(), 3));
}

std::deque<OutgoingLine> entry_lines(const PathEntry& entry, std::int64_t line,
                                     std::int64_t offset) {
  return EntryWriter(entry, line, offset).write();
}

std::vector<std::string> entry_steps(const PathEntry& entry) {
  const EntryWriter writer(entry, 0, 0);
  const Eigen::Vector3d first = writer.targets().front();
  const SpindleOrder order = spindle_order(entry.state);
  std::vector<std::string> steps;
  steps.push_back("go up to machine Z" + trimmed_decimal(writer.retract_z(), 3));
  if (entry.state.tool > 0) {
    steps.push_back("tool " + std::to_string(entry.state.tool) + " must be in the spindle");
  }
  if (entry.info.dialect.spindle_by_hand && !order.turning()) {
    steps.emplace_back(
        "switch the spindle on by hand, now: it must turn before the tool comes down");
  }
  if (order.turning()) {
    steps.push_back("start the spindle at " + trimmed_decimal(order.rpm, 0) + " rpm and verify it");
  }
  steps.push_back("go over machine " + point_text({first.x(), first.y(), writer.retract_z()}));
  steps.push_back("go down to machine Z" + trimmed_decimal(writer.clear_z(first.z()), 3) +
                  ", then at F" + trimmed_decimal(writer.plunge_feed(), 1) + " to Z" +
                  trimmed_decimal(first.z(), 3));
  if (!entry.path.empty()) {
    steps.push_back("come down onto the path, cut before, over " +
                    trimmed_decimal(entry.options.ramp, 3) + " mm of it from " +
                    trimmed_decimal(entry.options.lift, 3) + " mm above");
  }
  return steps;
}

namespace {

/// Coordinate systems are reported with three decimals, mm.
constexpr double kOriginTolerance = 0.0015;

/// A move that goes less than this part of its height across is a plunge or a retract.
constexpr double kMinShareAcross = 0.1;

/// Motions kept to choose the entry among.
constexpr std::size_t kHistory = 4096;

/// One executed line: the state before it and its motions.
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

/// The path of the last cuts in the history, long enough for the descent; empty if there is none.
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
    const Eigen::Vector3d& is = origins.at(i);
    if ((was - is).cwiseAbs().maxCoeff() <= kOriginTolerance) continue;
    throw InputError("G" + std::to_string(54 + i) + " began at " + point_text(was) +
                     " when the job was begun and begins at " + point_text(is) +
                     " now: the part would be cut at another place");
  }
}

/// The entry must begin below the tool's current height: nothing is known about the space above.
void require_below_retract(const PathEntry& entry) {
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
  const PathEntry entry{path, history.state, info, facts, options};
  require_below_retract(entry);
  plan.before = entry_lines(entry, plan.line - 1, plan.offset);
  plan.steps = entry_steps(entry);
  plan.steps.push_back("run the program from line " + std::to_string(plan.line) + " on; lines " +
                       std::to_string(plan.entry_line) + " to " + std::to_string(plan.overlap_end) +
                       " may be cut twice");
  return plan;
}

}  // namespace lensforge
