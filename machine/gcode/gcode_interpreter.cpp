// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/gcode_interpreter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "core/text/number_text.h"
#include "machine/gcode/gcode_dialect.h"
#include "machine/gcode/gcode_reader.h"

namespace lensforge {
namespace {

/// Modal groups: at most one word of each is allowed on a line. RS-274/NGC, table 4.
enum class ModalGroup {
  kNonModal,  ///< G4 G28 G30 G53
  kMotion,
  kPlane,
  kDistance,
  kArcDistance,
  kFeedMode,
  kUnits,
  kCutterCompensation,
  kToolLength,
  kCoordinateSystem,
  kPathControl,
  kStop,
  kToolChange,
  kSpindle,
  kCoolant,
};
constexpr std::size_t kModalGroups = 15;

/// The G and M words of one line, by group, ten times their numbers.
class ModalWords {
 public:
  /// @throw GcodeError naming a word that the dialect lacks, or two of one group.
  ModalWords(const GcodeBlock& block, const GcodeDialect& dialect);

  [[nodiscard]] std::optional<int> operator[](ModalGroup group) const {
    return words_[static_cast<std::size_t>(group)];
  }
  [[nodiscard]] bool has(ModalGroup group, int tenths) const { return (*this)[group] == tenths; }

 private:
  std::array<std::optional<int>, kModalGroups> words_;
};

std::string word_name(const GcodeWord& word) {
  std::string name = std::string(1, word.letter).append(std::to_string(word.tenths / 10));
  if (word.tenths % 10 != 0) name.append(".").append(std::to_string(word.tenths % 10));
  return name;
}

std::optional<ModalGroup> g_group(int tenths) {
  switch (tenths) {
    case 40:
    case 280:
    case 300:
    case 530:
      return ModalGroup::kNonModal;
    case 0:
    case 10:
    case 20:
    case 30:
    case 800:
      return ModalGroup::kMotion;
    case 170:
    case 180:
    case 190:
      return ModalGroup::kPlane;
    case 200:
    case 210:
      return ModalGroup::kUnits;
    case 400:
      return ModalGroup::kCutterCompensation;
    case 430:
    case 431:
    case 490:
      return ModalGroup::kToolLength;
    case 540:
    case 550:
    case 560:
    case 570:
    case 580:
    case 590:
      return ModalGroup::kCoordinateSystem;
    case 51:
    case 610:
    case 611:
    case 640:
      return ModalGroup::kPathControl;
    case 900:
    case 910:
      return ModalGroup::kDistance;
    case 911:
      return ModalGroup::kArcDistance;
    case 930:
    case 940:
      return ModalGroup::kFeedMode;
    default:
      return std::nullopt;
  }
}

std::optional<ModalGroup> m_group(int tenths) {
  switch (tenths) {
    case 0:
    case 10:
    case 20:
    case 300:
      return ModalGroup::kStop;
    case 30:
    case 40:
    case 50:
      return ModalGroup::kSpindle;
    case 60:
      return ModalGroup::kToolChange;
    case 70:
    case 80:
    case 90:
      return ModalGroup::kCoolant;
    default:
      return std::nullopt;
  }
}

/// True if this controller lacks a word that others know.
bool lacks(const GcodeDialect& dialect, const GcodeWord& word) {
  if (word.letter == 'M') {
    return (word.tenths == 60 && !dialect.tool_change) || (word.tenths == 70 && !dialect.mist);
  }
  switch (word.tenths) {
    case 0:
      return !dialect.rapid_word;
    case 51:
      return !dialect.contour_control;
    case 200:
      return !dialect.inches;
    case 430:
      return !dialect.tool_length;
    case 431:
      return !dialect.stated_length;
    case 611:
    case 640:
      return !dialect.path_blending;
    default:
      return false;
  }
}

/// Suggests a replacement for a word that a controller lacks; empty if there is none.
std::string way_out(const GcodeWord& word, const GcodeDialect& dialect) {
  const bool tool_change = word.letter == 'M' && word.tenths == 60;
  if (tool_change) return "; send one program for each tool";
  const bool table = word.letter == 'G' && word.tenths == 430;
  if (table && dialect.stated_length) {
    return ", which has no tool table; state the length with G43.1 Z, or touch off every tool";
  }
  return {};
}

[[noreturn]] void refuse_unknown(const GcodeBlock& block, const GcodeWord& word,
                                 const GcodeDialect& dialect) {
  const int tenths = word.tenths;
  const bool stores = word.letter == 'G' && (tenths == 100 || tenths == 281 || tenths == 301 ||
                                             (tenths >= 920 && tenths < 930));
  const std::string why = stores ? " changes the controller's stored offsets, which a job may not"
                                 : " is not supported for " + dialect.name + way_out(word, dialect);
  throw GcodeError(block.line, word_name(word) + why);
}

void refuse_letter(const GcodeBlock& block, char letter, const GcodeDialect& dialect) {
  constexpr std::string_view kLetters = "FGIJKMPSTXYZ";
  const bool known =
      kLetters.find(letter) != std::string_view::npos || (letter == 'H' && dialect.tool_length) ||
      (letter == 'R' && dialect.radius_arcs) || (letter == 'Q' && dialect.contour_control) ||
      (letter == 'O' && dialect.program_number);
  if (!known) {
    throw GcodeError(block.line,
                     std::string(1, letter) + " is no word that " + dialect.name + " knows");
  }
}

ModalWords::ModalWords(const GcodeBlock& block, const GcodeDialect& dialect) {
  for (const GcodeWord& word : block.words()) {
    refuse_letter(block, word.letter, dialect);
    if (word.letter != 'G' && word.letter != 'M') continue;
    const auto group = word.letter == 'G' ? g_group(word.tenths) : m_group(word.tenths);
    if (!group) refuse_unknown(block, word, dialect);
    if (lacks(dialect, word)) refuse_unknown(block, word, dialect);
    std::optional<int>& slot = words_[static_cast<std::size_t>(*group)];
    if (slot) {
      throw GcodeError(block.line,
                       word_name(word) + " shares a line with another word of its modal group");
    }
    slot = word.tenths;
  }
}

std::string with_number(const std::string& word, double value) {
  return word + shortest_text(value);
}

/// One line on its way through a copy of the state.
class BlockRun {
 public:
  BlockRun(const GcodeBlock& block, const GcodeDialect& dialect, GcodeState& state,
           GcodeEffect& effect)
      : block_(block), dialect_(dialect), words_(block, dialect), state_(state), effect_(effect) {}

  void run() {
    check_number();
    if (take_program_number()) return;
    set_modes();
    set_path_control();
    set_tool();
    set_tool_length();
    set_feed();
    set_machine();
    const bool moves = find_motion();
    refuse_unused(moves);
    if (moves) move();
    set_stop();
  }

 private:
  [[noreturn]] void refuse(const std::string& reason) const {
    throw GcodeError(block_.line, reason);
  }

  /// The value of a letter that this line uses.
  std::optional<double> use(char letter) {
    const auto value = block_.value(letter);
    if (value) used_ += letter;
    return value;
  }

  void check_number() const {
    if (block_.number && *block_.number > dialect_.max_line_number) {
      refuse(std::string("N").append(std::to_string(*block_.number)) + ": " + dialect_.name +
             " has none above " + std::to_string(dialect_.max_line_number));
    }
  }

  /// @return whether the line is nothing but an O word.
  bool take_program_number() {
    const auto number = use('O');
    if (!number) return false;
    if (block_.words().size() > 1) refuse("O must be alone on its line");
    if (!(*number >= 1.0) || *number != std::floor(*number)) {
      refuse(with_number("O", *number) + ": programs are numbered from 1");
    }
    return true;
  }

  void set_path_control() {
    const auto word = words_[ModalGroup::kPathControl];
    if (!word) return;
    if (*word == 51) {
      if (!use('Q')) refuse("G5.1 without Q");
      return;
    }
    state_.blending.reset();
    if (*word != 640) return;
    if (words_.has(ModalGroup::kNonModal, 40)) refuse("G64 beside G4");
    const double tolerance = use('P').value_or(0.0);
    if (tolerance < 0.0) refuse(with_number("G64 P", tolerance) + ": a tolerance is not negative");
    state_.blending = length(tolerance);
  }

  void set_tool_length() {
    const auto word = words_[ModalGroup::kToolLength];
    if (!word) return;
    if (dialect_.stated_length) refuse_beside_motion(*word);
    state_.tool_length = 0;
    state_.stated_length = 0.0;
    if (*word == 430) state_.tool_length = length_number();
    if (*word == 431) state_.stated_length = length(block_.value('Z').value_or(0.0));
  }

  int length_number() {
    const auto offset = use('H');
    if (offset) return tool_number('H', *offset);
    if (!dialect_.loaded_length) refuse("G43 without H");
    return state_.loaded_tool;
  }

  void refuse_beside_motion(int word) const {
    const std::string name = word == 431 ? "G43.1" : "G49";
    const auto motion = words_[ModalGroup::kMotion];
    const bool moves = (motion && *motion != 800) || words_[ModalGroup::kNonModal] ||
                       block_.value('X') || block_.value('Y');
    if (moves || (word == 490 && has_axes())) refuse(name + " beside a motion");
    if (word == 431 && !has_axes()) refuse("G43.1 without Z");
    if (word == 431 && !state_.inches) {
      refuse("G43.1 before G20 or G21: its unit is not known");
    }
  }

  void set_modes() {
    if (const auto word = words_[ModalGroup::kUnits]) state_.inches = *word == 200;
    if (const auto word = words_[ModalGroup::kPlane]) {
      state_.plane = *word == 170 ? ArcPlane::kXY : *word == 180 ? ArcPlane::kZX : ArcPlane::kYZ;
    }
    if (const auto word = words_[ModalGroup::kDistance]) state_.absolute = *word == 900;
    if (const auto word = words_[ModalGroup::kCoordinateSystem]) {
      state_.coordinate_system = *word / 10 - 54;
    }
    if (const auto word = words_[ModalGroup::kMotion]) state_.motion = motion_mode(*word);
  }

  static MotionMode motion_mode(int tenths) {
    switch (tenths) {
      case 0:
        return MotionMode::kRapid;
      case 10:
        return MotionMode::kFeed;
      case 20:
        return MotionMode::kArcClockwise;
      case 30:
        return MotionMode::kArcCounterClockwise;
      default:
        return MotionMode::kNone;
    }
  }

  /// Millimetres of a length of the program.
  [[nodiscard]] double length(double value) const {
    return state_.inches.value_or(false) ? value * kMillimetresPerInch : value;
  }

  void set_feed() {
    if (const auto word = words_[ModalGroup::kFeedMode]) {
      const bool inverse_time = *word == 930;
      // The number in force means something else in the other mode.
      if (inverse_time != state_.inverse_time) state_.feed.reset();
      state_.inverse_time = inverse_time;
    }
    const auto feed = use('F');
    if (!feed) return;
    if (!(*feed > 0.0)) refuse(with_number("F", *feed) + ": a feed is above 0");
    if (state_.inverse_time) {
      moves_per_minute_ = *feed;
    } else {
      state_.feed = length(*feed);
      if (!state_.inches) refuse("F before G20 or G21: its unit is not known");
    }
  }

  void set_tool() {
    if (const auto tool = use('T')) state_.tool = tool_number('T', *tool);
    if (!words_[ModalGroup::kToolChange]) return;
    effect_.tool_change = state_.loaded_tool = state_.tool;
  }

  void set_machine() {
    if (const auto rpm = use('S')) {
      if (*rpm < 0.0) refuse(with_number("S", *rpm) + ": a speed is not negative");
      state_.rpm = *rpm;
      effect_.spindle_changed = true;
    }
    if (const auto word = words_[ModalGroup::kSpindle]) {
      state_.spindle = *word == 30   ? SpindleTurn::kClockwise
                       : *word == 40 ? SpindleTurn::kCounterClockwise
                                     : SpindleTurn::kOff;
      effect_.spindle_changed = true;
    }
    if (const auto word = words_[ModalGroup::kCoolant]) {
      state_.mist = *word == 70 || (state_.mist && *word != 90);
      state_.flood = *word == 80 || (state_.flood && *word != 90);
    }
  }

  [[nodiscard]] int tool_number(char letter, double value) const {
    if (value < 0.0 || value > dialect_.max_tool || value != std::floor(value)) {
      refuse(std::string(1, letter) + shortest_text(value) + ": " + dialect_.name +
             " numbers tools from 0 to " + std::to_string(dialect_.max_tool));
    }
    return static_cast<int>(value);
  }

  [[nodiscard]] bool has_axes() const {
    return block_.value('X') || block_.value('Y') || block_.value('Z');
  }

  /// Decides what the coordinates belong to, and takes the words that go with it.
  bool find_motion() {
    const auto special = words_[ModalGroup::kNonModal];
    const auto motion = words_[ModalGroup::kMotion];
    if (words_.has(ModalGroup::kToolLength, 431)) return false;
    if (special == 40) {
      if (motion && *motion != 800) refuse("G4 beside a motion");
      if (has_axes()) refuse("G4 beside coordinates");
      take_dwell();
      return false;
    }
    if (special == 280 || special == 300) {
      if (motion) refuse("G28 and G30 must not share a line with another motion");
      return true;
    }
    return find_plain_motion(special == 530, motion.has_value());
  }

  bool find_plain_motion(bool machine_coordinates, bool stated) {
    const bool circle = stated && is_arc() && has_offsets();
    if (!has_axes() && !circle) {
      if (machine_coordinates) refuse("G53 without coordinates");
      if (stated && is_arc()) refuse("an arc without coordinates");
      const bool feeds = stated && state_.motion == MotionMode::kFeed;
      const bool fed =
          state_.inverse_time ? moves_per_minute_.has_value() : state_.feed.has_value();
      if (feeds && !fed) refuse("G1 before a feed F");
      return false;
    }
    if (state_.motion == MotionMode::kNone) refuse("coordinates after G80, without a motion");
    if (machine_coordinates && is_arc()) refuse("G53 works with G0 and G1 only");
    return true;
  }

  [[nodiscard]] bool is_arc() const {
    return state_.motion == MotionMode::kArcClockwise ||
           state_.motion == MotionMode::kArcCounterClockwise;
  }

  [[nodiscard]] bool has_offsets() const {
    return block_.value('I') || block_.value('J') || block_.value('K');
  }

  void take_dwell() {
    const auto seconds = use('P');
    if (!seconds) refuse("G4 without P");
    if (*seconds < 0.0) refuse(with_number("G4 P", *seconds) + ": a time is not negative");
    effect_.dwell = *seconds * dialect_.dwell_unit;
  }

  [[nodiscard]] bool goes_home() const {
    return words_.has(ModalGroup::kNonModal, 280) || words_.has(ModalGroup::kNonModal, 300);
  }

  void refuse_unused(bool moves) const {
    const bool arc = moves && is_arc() && !goes_home();
    for (const GcodeWord& word : block_.words()) {
      const std::string_view of_motions = arc ? "XYZIJKR" : "XYZ";
      const bool used = word.letter == 'G' || word.letter == 'M' ||
                        used_.find(word.letter) != std::string::npos ||
                        of_motions.find(word.letter) != std::string_view::npos;
      if (!used) refuse(std::string(1, word.letter) + " belongs to no word of this line");
    }
  }

  void move() {
    if (!state_.inches) refuse("a motion before G20 or G21: its unit is not known");
    if (goes_home()) return go_home();
    GcodeMotion motion = new_motion(target());
    if (is_arc()) motion.arc = arc_to(motion.end);
    motion.rapid = state_.motion == MotionMode::kRapid;
    if (!motion.rapid) {
      if (dialect_.feed_on_every_line && !block_.value('F')) {
        refuse("a motion without F on its line");
      }
      motion.feed = feed_over(motion.length());
      if (!motion.arc && is_rapid_feed(motion.feed)) make_rapid(motion);
    }
    add(motion);
  }

  [[nodiscard]] bool is_rapid_feed(double feed) const {
    const auto& feeds = dialect_.rapid_feeds;
    return std::find(feeds.begin(), feeds.end(), feed) != feeds.end();
  }

  static void make_rapid(GcodeMotion& motion) {
    motion.rapid = true;
    motion.feed = 0.0;
  }

  [[nodiscard]] Eigen::Vector3d target() const {
    const bool machine = words_.has(ModalGroup::kNonModal, 530);
    Eigen::Vector3d target = state_.position;
    for (int axis = 0; axis < 3; ++axis) {
      const auto value = block_.value("XYZ"[axis]);
      if (!value) continue;
      if (machine) {
        target[axis] = length(*value);
      } else if (state_.absolute) {
        target[axis] = length(*value) + state_.origin()[axis];
      } else {
        target[axis] += length(*value);
      }
    }
    return target;
  }

  [[nodiscard]] GcodeMotion new_motion(const Eigen::Vector3d& end) const {
    GcodeMotion motion;
    motion.start = state_.position;
    motion.end = end;
    motion.line = block_.line;
    motion.offset = block_.offset;
    motion.number = block_.number;
    return motion;
  }

  [[nodiscard]] Arc arc_to(const Eigen::Vector3d& end) {
    ArcRequest request;
    request.plane = state_.plane;
    request.clockwise = state_.motion == MotionMode::kArcClockwise;
    for (int axis = 0; axis < 3; ++axis) {
      request.offset[axis] = length(block_.value("IJK"[axis]).value_or(0.0));
    }
    const auto radius = block_.value('R');
    if (radius && has_offsets()) refuse("an arc with both R and I J K");
    if (!radius && !has_offsets()) refuse("an arc without R and without I J K");
    if (radius) request.radius = length(*radius);
    effect_.bare_circle = !has_axis_in_plane();
    if (radius && effect_.bare_circle) refuse("an arc with R without a coordinate in its plane");
    const ArcResult result = make_arc(state_.position, end, request);
    if (!result.reason.empty()) refuse(result.reason);
    return result.arc;
  }

  [[nodiscard]] bool has_axis_in_plane() const {
    const char normal = state_.plane == ArcPlane::kXY   ? 'Z'
                        : state_.plane == ArcPlane::kZX ? 'Y'
                                                        : 'X';
    for (const char axis : {'X', 'Y', 'Z'}) {
      if (axis != normal && block_.value(axis)) return true;
    }
    return false;
  }

  [[nodiscard]] double feed_over(double length) const {
    if (state_.inverse_time) {
      if (!moves_per_minute_) refuse("a motion under G93 without F on its line");
      return *moves_per_minute_ * length;
    }
    if (!state_.feed) refuse("a motion before a feed F");
    return *state_.feed;
  }

  /// By way of the point that the line names, then to the stored place in the axes that it names,
  /// or in all if it names none.
  void go_home() {
    const bool first = words_.has(ModalGroup::kNonModal, 280);
    const auto& home = first ? state_.g28 : state_.g30;
    if (!home) refuse(std::string(first ? "G28" : "G30") + ": its stored place is not known");
    Eigen::Vector3d last = *home;
    if (has_axes()) {
      add(rapid_to(target()));
      for (int axis = 0; axis < 3; ++axis) {
        if (!block_.value("XYZ"[axis])) last[axis] = state_.position[axis];
      }
    }
    add(rapid_to(last));
  }

  [[nodiscard]] GcodeMotion rapid_to(const Eigen::Vector3d& end) const {
    GcodeMotion motion = new_motion(end);
    motion.rapid = true;
    return motion;
  }

  void add(const GcodeMotion& motion) {
    state_.position = motion.end;
    effect_.add(motion);
  }

  void set_stop() {
    const auto word = words_[ModalGroup::kStop];
    if (!word) return;
    effect_.pauses = *word == 0;
    effect_.ends = *word == 20 || *word == 300;
    if (effect_.ends) reset_modes();
  }

  /// Resets the modes that M2 and M30 reset, in Grbl and in RS-274/NGC.
  void reset_modes() {
    state_.motion = MotionMode::kFeed;
    state_.plane = ArcPlane::kXY;
    state_.absolute = true;
    state_.inverse_time = false;
    state_.coordinate_system = 0;
    state_.spindle = SpindleTurn::kOff;
    state_.mist = state_.flood = false;
    effect_.spindle_changed = true;
  }

  const GcodeBlock& block_;
  const GcodeDialect& dialect_;
  ModalWords words_;
  GcodeState& state_;
  GcodeEffect& effect_;
  std::optional<double> moves_per_minute_;  ///< F under G93.
  std::string used_;
};

}  // namespace

GcodeInterpreter::GcodeInterpreter(const GcodeDialect& dialect, const GcodeState& start)
    : dialect_(dialect), state_(start) {}

GcodeEffect GcodeInterpreter::run(const GcodeBlock& block) {
  GcodeEffect effect;
  if (block.percent) {
    run_percent(block, effect);
    return effect;
  }
  if (block.empty()) return effect;
  if (ended_) throw GcodeError(block.line, "words after the end of the program");
  if (begun_ && block.value('O')) throw GcodeError(block.line, "O after the program's first line");
  GcodeState next = state_;
  BlockRun(block, dialect_, next, effect).run();
  state_ = next;
  begun_ = true;
  ended_ = effect.ends;
  return effect;
}

void GcodeInterpreter::run_percent(const GcodeBlock& block, GcodeEffect& effect) {
  ++percents_;
  const bool begins = percents_ == 1 && !begun_;
  if (percents_ > 2 || (percents_ == 1 && begun_ && !ended_)) {
    throw GcodeError(block.line, "% neither at the begin nor at the end of the program");
  }
  if (!begins && !ended_) {
    effect.ends = true;
    ended_ = true;
  }
}

void GcodeInterpreter::check_length(const GcodeText& text, std::size_t added) const {
  const std::size_t length = compact_gcode(text.text, added == 0).size() + added;
  if (length > dialect_.max_characters) {
    throw GcodeError(text.line, std::to_string(length) + " characters to send, more than the " +
                                    std::to_string(dialect_.max_characters) + " that " +
                                    dialect_.name + " takes");
  }
}

}  // namespace lensforge
