// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "machine/sim/sim_firmware.h"
#include "machine/sim/sim_queue.h"

namespace lensforge {

/// The words of one line, as parsed by the firmware.
struct SimWords {
  std::array<std::optional<double>, 26> values;  ///< By letter, except G and M.
  std::vector<int> g;                            ///< Ten times the number of each G word.
  std::vector<int> m;

  [[nodiscard]] std::optional<double> operator[](char letter) const {
    return values[static_cast<std::size_t>(letter - 'A')];
  }
  [[nodiscard]] bool any(std::string_view letters) const;
};

/// Parses a line without blanks and comments, in upper case. @return 0 or an error number: 1, 2,
/// 20, 23, 25.
int split_words(std::string_view line, SimWords& words);

/// The G and M words of one line by modal group, ten times their numbers.
struct SimGroups {
  std::optional<int> special;  ///< Active for this line only: G4, G10, G28, G53 …
  std::optional<int> motion;
  std::optional<int> plane;
  std::optional<int> units;
  std::optional<int> distance;
  std::optional<int> feed_mode;
  std::optional<int> frame;
  std::optional<int> tool_length;           ///< G43.1, G49
  std::array<std::optional<int>, 3> quiet;  ///< Accepted without effect: G40, G61 …
  std::optional<int> stop;
  std::optional<int> spindle;
  std::optional<int> coolant;
  std::optional<int> tool;
  int error = 0;  ///< 0 or an error number: 4, 20, 21, 27.

  [[nodiscard]] bool any_quiet() const;
};

/// Sorts a line's words by group and checks each by itself.
SimGroups group_words(const SimWords& words, const SimulatedOptions& options);

/// The chords that the simulated controller runs instead of an arc.
struct SimArc {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  int plane = 17;
  double turn = 0.0;  ///< rad, counter-clockwise positive.
  int chords = 1;

  /// End of chord 1 … chords.
  [[nodiscard]] Eigen::Vector3d chord_end(int chord) const;
  /// Length of the true arc.
  [[nodiscard]] double length() const;
};

/// Arc words of a line, mm.
struct SimArcWords {
  int plane = 17;
  bool clockwise = false;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  std::optional<double> radius;
  double tolerance = 0.002;
};

/// Fills `arc`. @return 0 or an error number: 33, 34.
int lay_arc(const Eigen::Vector3d& start, const Eigen::Vector3d& end, const SimArcWords& words,
            SimArc& arc);

/// Active modes of the firmware's parser. Each line returns a new value.
struct SimModes {
  int motion = 0;  ///< Ten times the number.
  int plane = 17;
  bool inches = false;
  bool absolute = true;
  bool inverse_time = false;
  int origin = 0;  ///< 0 for G54 … 5 for G59.
  int spindle = 0;
  int coolant = 0;
  int tool = 0;
  double feed = 0.0;
  double rpm = 0.0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  ///< G92
  double tool_length = 0.0;                         ///< G43.1, along Z

  /// Millimetres in one unit of the line's lengths.
  [[nodiscard]] double scale() const { return inches ? 25.4 : 1.0; }
};

/// G-code data in the firmware's EEPROM.
struct SimStored {
  std::array<Eigen::Vector3d, 6> origins = no_origins();  ///< G54 … G59
  Eigen::Vector3d g28 = Eigen::Vector3d::Zero();
  Eigen::Vector3d g30 = Eigen::Vector3d::Zero();

 private:
  static std::array<Eigen::Vector3d, 6> no_origins() {
    std::array<Eigen::Vector3d, 6> origins;
    origins.fill(Eigen::Vector3d::Zero());
    return origins;
  }
};

/// Sum of the offsets in force: machine − work.
inline Eigen::Vector3d offset_of(const SimModes& modes, const SimStored& stored) {
  return stored.origins[static_cast<std::size_t>(modes.origin)] + modes.shift +
         modes.tool_length * Eigen::Vector3d::UnitZ();
}

/// One action of the controller; a line's actions run one after another.
struct SimAction {
  enum class Kind {
    kMove,     ///< `move`, or `arc` in its chords.
    kSync,     ///< Wait until nothing moves.
    kDwell,    ///< `value` seconds.
    kSpindle,  ///< `turn`, `value`: requested rpm.
    kCoolant,  ///< `turn` bits: 1 mist, 2 flood.
    kTool,     ///< Wait for the operator.
    kPause,    ///< M0: hold until resumed.
    kEnd,      ///< M2, M30
    kStore,    ///< A write to the EEPROM.
  };
  Kind kind = Kind::kSync;
  SimMove move;
  std::optional<SimArc> arc;
  double value = 0.0;
  int turn = 0;
};

/// One parsed line.
struct SimLine {
  SimWords words;
  SimGroups groups;
  double arc_tolerance = 0.002;  ///< $12, mm

  [[nodiscard]] bool has_axes() const { return words.any("XYZ"); }
};

/// State of the parser within a line: each step maps one state to the next.
struct SimLineState {
  SimModes modes;
  SimStored stored;
  std::vector<SimAction> actions;  ///< The line's actions so far.
  std::string used = "N";          ///< Letters of the words already used.
  int error = 0;                   ///< Error number that ends the line here, or 0.
};

/// The steps of a line. @pre state.error == 0
namespace sim_step {
SimLineState feed(const SimLine& line, SimLineState state);     ///< G20 G21 G93 G94 F
SimLineState tool(const SimLine& line, SimLineState state);     ///< T M6
SimLineState spindle(const SimLine& line, SimLineState state);  ///< S M3 M4 M5
SimLineState coolant(const SimLine& line, SimLineState state);  ///< M7 M8 M9
SimLineState dwell(const SimLine& line, SimLineState state);    ///< G4
/// G17 G18 G19 G90 G91 G54 … G59, and the motion mode from here on.
SimLineState frame(const SimLine& line, SimLineState state);
/// Applies the axis words: G10 G28 G30 G92, or a motion.
SimLineState axes(const SimLine& line, SimLineState state);
SimLineState unused(const SimLine& line, SimLineState state);  ///< Refuses unused words.
SimLineState stop(const SimLine& line, SimLineState state);    ///< M0 M1 M2 M30
}  // namespace sim_step

/// Runs a line through all steps, in the order of the Grbl documentation, until one ends it. @param
/// state  the parser's state before the line.
SimLineState run_sim_line(const SimLine& line, SimLineState state);

/// Runs the part of `$J=` behind the sign.
SimLineState jog_sim_line(const SimLine& line, SimLineState state);

/// The firmware's G-code parser: keeps modes and stored data from line to line (run_sim_line()).
class SimGcode {
 public:
  SimGcode(const SimSettings& settings, const SimulatedOptions& options)
      : settings_(settings), options_(options) {}

  /// Runs one clean line (no blanks, no comments, upper case); appends to `actions`. @return 0, or
  /// an error number; then nothing has changed.
  int run(std::string_view line, std::vector<SimAction>& actions);
  /// Runs the part of `$J=` behind the sign. Changes no mode.
  int jog(std::string_view line, std::vector<SimAction>& actions);

  /// Restores the modes after a reset; stored offsets stay.
  void reset();
  /// Sets the tool's position when it differs from the programmed one.
  void set_position(const Eigen::Vector3d& position) { modes_.position = position; }
  void stop_spindle() { modes_.spindle = 0; }

  /// Sum of the offsets in force: machine − work.
  [[nodiscard]] Eigen::Vector3d offset() const { return offset_of(modes_, stored_); }
  [[nodiscard]] std::string state_text() const;       ///< `[GC:…]`
  [[nodiscard]] std::string parameters_text() const;  ///< `$#`
  /// Sets a work offset, 0 for G54.
  void set_origin(int index, const Eigen::Vector3d& origin) {
    stored_.origins[static_cast<std::size_t>(index)] = origin;
  }

 private:
  [[nodiscard]] SimLine read(const SimWords& words) const;
  [[nodiscard]] SimLineState state() const { return {modes_, stored_, {}, "N", 0}; }

  const SimSettings& settings_;
  const SimulatedOptions& options_;
  SimModes modes_;
  SimStored stored_;
};

}  // namespace lensforge
