// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/program_reader.h"

#include <algorithm>
#include <cerrno>
#include <fstream>

#include "core/error.h"
#include "core/io/files.h"
#include "machine/gcode/program_seal.h"

namespace lensforge {
namespace {

constexpr std::int64_t kLinesBetweenReports = 1 << 14;
constexpr double kStartReferenceZ = 100.0;  ///< mm

GcodeState start_state() {
  GcodeState state;
  state.g28 = state.g30 = Eigen::Vector3d(0.0, 0.0, kStartReferenceZ);
  return state;
}

/// Length of the line as sent to a controller: that of compact_gcode(), without making the text.
std::size_t sent_bytes(std::string_view text) {
  std::size_t bytes = 0;
  bool in_brackets = false;
  for (const char c : text) {
    if (c == ';' && !in_brackets) break;
    if (c == '(') in_brackets = true;
    if (!in_brackets && c != ' ' && c != '\t' && c != '%') ++bytes;
    if (c == ')') in_brackets = false;
  }
  return bytes == 0 ? 0 : bytes + 1;
}

bool goes_to_reference(const GcodeBlock& block) {
  return std::any_of(block.words().begin(), block.words().end(), [](const GcodeWord& word) {
    return word.letter == 'G' && (word.tenths == 280 || word.tenths == 300);
  });
}

/// Checks that programs state everything they cut with instead of relying on the controller's
/// memory.
class Checks {
 public:
  explicit Checks(const GcodeDialect& dialect)
      : tells_rapids_(dialect.rapid_word || dialect.rapid_feeds[0] > 0.0),
        spindle_by_hand_(dialect.spindle_by_hand) {}

  void take(const ProgramLine& line) {
    for (const GcodeMotion& motion : line.effect.motions()) {
      if (!motion.rapid) check_cut(motion, line.state);
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (line.block.value("XYZ"[axis])) known_[axis] = true;
    }
  }

 private:
  void check_cut(const GcodeMotion& motion, const GcodeState& state) const {
    const bool off = state.spindle == SpindleTurn::kOff || !(state.rpm > 0.0);
    if (off && !spindle_by_hand_ && tells_rapids_) {
      throw GcodeError(motion.line, "moves at feed while the spindle is off");
    }
    if (tells_rapids_ && !(known_[0] && known_[1] && known_[2])) {
      throw GcodeError(motion.line, "moves at feed from a place that the program has not stated");
    }
    if (state.inches.value_or(true)) throw GcodeError(motion.line, "is not in millimetres");
  }

  bool tells_rapids_;  ///< Else any motion may be one.
  bool spindle_by_hand_;
  bool known_[3] = {false, false, false};
};

/// One pass through a file.
class Walk {
 public:
  Walk(std::istream& in, const GcodeDialect& dialect)
      : reader_(in),
        interpreter_(dialect, start_state()),
        checks_(dialect),
        longest_(dialect.max_characters) {}

  void run(const LineSink& sink, const RunControl& control) {
    while (const auto text = reader_.next()) {
      take(*text, sink);
      if (text->line % kLinesBetweenReports != 0) continue;
      if (control.stop_requested()) throw Interrupted();
    }
    if (!interpreter_.ended()) throw GcodeError(last_line_, "the program has no end (M2 or M30)");
  }

 private:
  void take(const GcodeText& text, const LineSink& sink) {
    last_line_ = text.line;
    const GcodeBlock block = parse_gcode_block(text);
    const std::size_t bytes = sent_bytes(text.text);
    if (bytes > longest_ + 1) interpreter_.check_length(text, 0);
    const GcodeEffect effect = interpreter_.run(block);
    const ProgramLine line{block, effect, interpreter_.state(), bytes};
    checks_.take(line);
    sink(line);
  }

  GcodeReader reader_;
  GcodeInterpreter interpreter_;
  Checks checks_;
  std::size_t longest_;
  std::int64_t last_line_ = 0;
};

}  // namespace

void walk_program(const std::filesystem::path& path, const GcodeDialect& dialect,
                  const LineSink& sink, const RunControl& control) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) {
    const int why = std::filesystem::is_directory(path) ? EISDIR : errno;
    throw InputError(path.string() + ": cannot be read: " + system_reason(why));
  }
  try {
    Walk(file, dialect).run(sink, control);
  } catch (const GcodeError& error) {
    throw InputError(path.string() + ": " + error.what());
  }
}

void ReadingCollector::take(const ProgramLine& line) {
  reading_.lines = line.block.line;
  if (line.state.tool != 0 && line.effect.tool_change) {
    auto& tools = reading_.tools;
    const bool known = std::find(tools.begin(), tools.end(), line.state.tool) != tools.end();
    if (!known) tools.push_back(line.state.tool);
  }
  if (line.effect.motions().empty() || goes_to_reference(line.block)) return;
  for (const GcodeMotion& motion : line.effect.motions()) take_motion(motion);
  if (!line.effect.motions().back().rapid) reading_.blending = line.state.blending;
}

void ReadingCollector::take_motion(const GcodeMotion& motion) {
  ++reading_.motions;
  if (motion.rapid) {
    reading_.rapid_length += motion.length();
    return;
  }
  reading_.cutting.extend(motion.bounds());
  reading_.cutting_length += motion.length();
  reading_.arcs += motion.arc ? 1 : 0;
  const bool first = reading_.most_feed == 0.0;
  reading_.least_feed = first ? motion.feed : std::min(reading_.least_feed, motion.feed);
  reading_.most_feed = std::max(reading_.most_feed, motion.feed);
}

ProgramReading read_program(const std::filesystem::path& path, const GcodeDialect& dialect,
                            const MotionSink& sink, const RunControl& control) {
  ReadingCollector collector;
  walk_program(
      path, dialect,
      [&](const ProgramLine& line) {
        collector.take(line);
        if (line.effect.motions().empty() || goes_to_reference(line.block)) return;
        for (const GcodeMotion& motion : line.effect.motions()) sink(motion, line.state.tool);
      },
      control);
  ProgramReading reading = collector.reading();
  reading.seal_holds = check_seal(path);
  return reading;
}

ProgramTime& ProgramTime::operator+=(const ProgramTime& other) {
  seconds += other.seconds;
  stream_limited_seconds += other.stream_limited_seconds;
  lines += other.lines;
  blocks += other.blocks;
  starved += other.starved;
  if (other.peak_lines_per_second > peak_lines_per_second) {
    peak_lines_per_second = other.peak_lines_per_second;
    peak_line = other.peak_line;
  }
  return *this;
}

PlannerSettings planner_settings(const Machine& machine) {
  PlannerSettings settings;
  settings.max_rate = machine.max_rate;
  settings.acceleration = machine.acceleration;
  settings.steps_per_mm = machine.steps_per_mm;
  settings.junction_deviation = machine.junction_deviation;
  settings.arc_tolerance = machine.arc_tolerance;
  settings.blocks = machine.look_ahead;
  settings.lines_per_second = machine.lines_per_second;
  return settings;
}

ProgramTimer::ProgramTimer(const PlannerSettings& settings, double tool_change)
    : model_(settings), tool_change_(tool_change) {}

void ProgramTimer::take(const ProgramLine& line) {
  if (line.bytes > 0) model_.line(line.bytes);
  double waits = line.effect.dwell;
  if (line.effect.tool_change) waits += tool_change_;
  if (waits > 0.0 || line.effect.spindle_changed) model_.wait(waits);
  for (const GcodeMotion& motion : line.effect.motions()) model_.add(motion);
}

ProgramTime ProgramTimer::finish() {
  const PlanTime plan = model_.finish();
  time_.seconds = plan.seconds;
  time_.stream_limited_seconds = plan.stream_limited_seconds;
  time_.lines = plan.motions;
  time_.blocks = plan.blocks;
  time_.starved = plan.starved;
  time_.peak_lines_per_second = plan.peak_lines_per_second;
  time_.peak_line = plan.peak_line;
  return time_;
}

}  // namespace lensforge
