// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/post_check.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "cam/post/post_text.h"
#include "core/error.h"
#include "machine/gcode/gcode_interpreter.h"
#include "machine/gcode/program_seal.h"

namespace lensforge {
namespace {

/// Where a reference point is put while lines are tried out, mm.
constexpr double kReferenceZ = 100.0;

/// The tool length offset that a program before has left in force: no line of a description's own.
constexpr int kForeignLength = 77;

GcodeText text_of(const std::string& line) {
  GcodeText text;
  text.text = line;
  text.line = 1;
  return text;
}

/// A small program of the description, run line by line.
class Trial {
 public:
  Trial(const PostDescription& post, const TomlFields& fields, const GcodeState& start = {})
      : post_(post), fields_(fields), interpreter_(post.reader, with_references(start)) {
    texts_ = {{"job", "part"},   {"number", std::to_string(post.first_program_number)},
              {"tool", "1"},     {"rpm", "23000"},
              {"dwell", "2500"}, {"tolerance", "0.0005"}};
    append_coordinate(texts_["safe_z"], 5, 0, post);
    texts_["coolant"] = post.flood.empty() ? post.mist : post.flood;
    texts_["coolant_off"] = post.coolant_off;
  }

  /// Runs the lines of a key.
  void run(const std::string& key, const std::vector<std::string>& lines) {
    for (const std::string& line : lines) {
      check_placeholders(key, line);
      if (const auto filled = fill_line(line, texts_)) run_line(key, *filled);
    }
  }

  void require(const std::string& key, bool holds, const std::string& rule) const {
    if (!holds) fields_.refuse(key, rule);
  }

  [[nodiscard]] const GcodeInterpreter& interpreter() const { return interpreter_; }

 private:
  static GcodeState with_references(GcodeState state) {
    state.g28 = state.g30 = Eigen::Vector3d(0.0, 0.0, kReferenceZ);
    return state;
  }

  void check_placeholders(const std::string& key, const std::string& line) const {
    std::size_t close = 0;
    for (std::size_t open = line.find('{'); open != std::string::npos;
         open = line.find('{', close)) {
      close = line.find('}', open);
      const bool known = close != std::string::npos &&
                         is_placeholder(std::string_view(line).substr(open + 1, close - open - 1));
      if (!known) fields_.refuse(key, "'" + line + "': unknown placeholder");
    }
  }

  void run_line(const std::string& key, const std::string& line) {
    if (line.size() > post_.longest_line) {
      fields_.refuse(key, "'" + line + "' is longer than lines.longest");
    }
    try {
      for (const char c : line) {
        const bool plain = c >= ' ' && c < '\x7f' && c != '?' && c != '!' && c != '~';
        if (!plain) throw GcodeError(1, "characters must be printable ASCII but ? ! ~");
      }
      const GcodeBlock block = parse_gcode_block(text_of(line));
      const GcodeEffect effect = interpreter_.run(block);
      if (key == "spindle" && !effect.motions().empty()) {
        throw GcodeError(1, "these lines must not move the machine");
      }
      if (key == "head" && !head_.take(line)) {
        throw GcodeError(
            1,
            "the head is above the seal: only comments and a program number are allowed; "
            "what sets or moves anything belongs in start");
      }
    } catch (const GcodeError& error) {
      const std::string reason = error.what();
      fields_.refuse(key, "'" + line + "': " + reason.substr(reason.find(": ") + 2));
    }
  }

  const PostDescription& post_;
  const TomlFields& fields_;
  GcodeInterpreter interpreter_;
  HeaderLines head_;
  PlaceholderTexts texts_;
};

bool writes_as_programs_are(const GcodeState& state) {
  return state.inches == false && state.absolute && !state.inverse_time;
}

/// What a program before may have left in force: the opposite of what ours rely on.
GcodeState left_behind(int coordinate_system) {
  GcodeState state;
  state.motion = MotionMode::kFeed;
  state.plane = ArcPlane::kYZ;
  state.inches = true;
  state.absolute = false;
  state.inverse_time = true;
  state.coordinate_system = coordinate_system;
  state.tool_length = kForeignLength;
  return state;
}

/// Whether one of the lines has a G word, times ten.
bool states(const std::vector<std::string>& lines, int tenths) {
  return std::any_of(lines.begin(), lines.end(), [&](const std::string& line) {
    if (line.find('{') != std::string::npos) return false;
    const GcodeBlock block = parse_gcode_block(text_of(line));
    return std::any_of(block.words().begin(), block.words().end(), [&](const GcodeWord& word) {
      return word.letter == 'G' && word.tenths == tenths;
    });
  });
}

/// Holds what `start` leaves in force against what programs rely on, whatever was in force before.
void check_start(const PostDescription& post, const TomlFields& fields) {
  std::set<int> systems;
  for (const int before : {0, 1}) {
    Trial trial(post, fields, left_behind(before));
    trial.run("head", post.head);
    trial.run("start", post.start);
    const GcodeState& state = trial.interpreter().state();
    trial.require("start", writes_as_programs_are(state),
                  "must set millimetres (G21), absolute coordinates (G90) and feed per minute "
                  "(G94), whatever was in force before");
    trial.require("start", state.plane == ArcPlane::kXY, "must set the plane of X and Y (G17)");
    systems.insert(state.coordinate_system);
    trial.require("start", systems.size() == 1, "must choose a coordinate system (G54 ... G59)");
    trial.require("start", state.tool_length != kForeignLength,
                  "must cancel tool length offsets from before (G49)");
  }
  Trial trial(post, fields);
  trial.require("start", states(post.start, 800), "must cancel canned cycles from before (G80)");
  // The others have no such words.
  const bool compensates = post.reader.tool_length || post.reader.path_blending;
  trial.require("start", !compensates || states(post.start, 400),
                "must cancel cutter compensation from before (G40)");
}

/// Whether `word` alone on a line makes `holds` true of the state.
template <class Holds>
void check_word(const PostDescription& post, const TomlFields& fields, const std::string& key,
                const std::string& word, const Holds& holds) {
  Trial trial(post, fields);
  trial.run(key, {word});
  trial.require(key, holds(trial.interpreter().state()),
                "does not do what the key says, for reader " + post.reader.name);
}

void check_plane(const PostDescription& post, const TomlFields& fields, const std::string& key,
                 ArcPlane plane) {
  const std::size_t normal = plane == ArcPlane::kXY ? 2 : plane == ArcPlane::kZX ? 1 : 0;
  // From another plane than that of a reset, so that a word that does nothing is found.
  const std::string other = plane == ArcPlane::kXY ? "G19" : "G17";
  Trial trial(post, fields);
  trial.run(key, {other, post.planes[normal]});
  trial.require(key, trial.interpreter().state().plane == plane,
                "is not the word of this plane for reader " + post.reader.name);
}

void check_motions(const PostDescription& post, const TomlFields& fields) {
  const std::pair<const char*, MotionMode> motions[] = {
      {"rapid", post.rapids_are_feeds() ? MotionMode::kFeed : MotionMode::kRapid},
      {"feed", MotionMode::kFeed},
      {"clockwise", MotionMode::kArcClockwise},
      {"counter_clockwise", MotionMode::kArcCounterClockwise}};
  for (std::size_t i = 0; i < std::size(motions); ++i) {
    const std::string line = post.motions[i] + (i < 2 ? " X1 F100" : " X1 I0.5 F100");
    Trial trial(post, fields);
    trial.run(motions[i].first, {"G21 G17", line});
    trial.require(motions[i].first, trial.interpreter().state().motion == motions[i].second,
                  "is not the word of this motion for reader " + post.reader.name);
  }
}

}  // namespace

void check_words(const PostDescription& post, const TomlFields& fields) {
  check_motions(post, fields);
  check_plane(post, fields, "plane_xy", ArcPlane::kXY);
  check_plane(post, fields, "plane_zx", ArcPlane::kZX);
  check_plane(post, fields, "plane_yz", ArcPlane::kYZ);
  const auto mist = [](const GcodeState& state) { return state.mist; };
  const auto flood = [](const GcodeState& state) { return state.flood; };
  const auto off = [](const GcodeState& state) { return !state.mist && !state.flood; };
  if (!post.mist.empty()) check_word(post, fields, "mist", post.mist, mist);
  if (!post.flood.empty()) check_word(post, fields, "flood", post.flood, flood);
  if (!post.coolant_off.empty()) check_word(post, fields, "coolant_off", post.coolant_off, off);
}

bool check_program_lines(const PostDescription& post, const TomlFields& fields) {
  Trial trial(post, fields);
  const auto& state = trial.interpreter();
  trial.run("head", post.head);
  trial.run("start", post.start);
  check_start(post, fields);
  const int system = state.state().coordinate_system;
  bool applies_length = false;
  for (int tool = 0; tool < 2; ++tool) {
    trial.run("tool", post.tool);
    applies_length = state.state().tool_length != 0;
    trial.require("tool", !post.changes_tools() || state.state().tool == 1,
                  "must name the tool: T{tool}");
    trial.run("spindle", post.spindle);
    trial.require("spindle",
                  state.state().spindle != SpindleTurn::kOff && state.state().rpm == 23000.0,
                  "must start the spindle at S{rpm}");
    trial.require("tool",
                  writes_as_programs_are(state.state()) && state.state().plane == ArcPlane::kXY &&
                      state.state().coordinate_system == system,
                  "must leave millimetres, absolute coordinates, feed per minute, the plane of X "
                  "and Y and the coordinate system in force");
    trial.run("tool_end", post.tool_end);
    trial.require("tool_end", state.state().spindle == SpindleTurn::kOff, "must stop the spindle");
  }
  trial.run("end", post.end);
  trial.require("end", state.ended(), "must end the program (M2 or M30)");
  return applies_length;
}

}  // namespace lensforge
