// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "machine/sim/sim_arc.h"
#include "machine/sim/sim_queue.h"
#include "machine/sim/sim_settings.h"
#include "machine/sim/sim_words.h"

namespace lensforge {

/// One thing that a line makes the controller do; those of a line are done one after another.
struct SimAction {
  enum class Kind {
    kMove,     ///< `move`, or `arc` in its chords.
    kSync,     ///< Wait until nothing moves.
    kDwell,    ///< `value` seconds.
    kSpindle,  ///< `turn`, `value` rpm asked for.
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

/// The firmware's G-code parser: modes, checks with error numbers, and what follows from a line.
class SimGcode {
 public:
  SimGcode(const SimSettings& settings, const SimulatedOptions& options);

  /// Runs one clean line (no blanks, no comments, upper case); appends to `actions`.
  /// @return 0, or the number of the error; nothing has changed then.
  int run(std::string_view line, std::vector<SimAction>& actions);
  /// Runs the part of `$J=` behind the sign. Changes no mode.
  int jog(std::string_view line, std::vector<SimAction>& actions);

  /// Back to what holds after a reset; stored offsets stay.
  void reset();
  /// Where the tool is, once it is not where the lines led it.
  void set_position(const Eigen::Vector3d& position) { modes_.position = position; }
  void stop_spindle() { modes_.spindle = 0; }

  /// Sum of the offsets in force: machine − work.
  [[nodiscard]] Eigen::Vector3d offset() const;
  [[nodiscard]] std::string state_text() const;       ///< `[GC:…]`
  [[nodiscard]] std::string parameters_text() const;  ///< `$#`
  /// Sets a work offset, 0 for G54.
  void set_origin(int index, const Eigen::Vector3d& origin) {
    stored_.origins[static_cast<std::size_t>(index)] = origin;
  }

 private:
  struct Modes {
    int motion = 0;  ///< Ten times the word.
    int plane = 17;
    bool inches = false;
    bool absolute = true;
    bool inverse_time = false;
    int origin = 0;
    int spindle = 0;
    int coolant = 0;
    int tool = 0;
    double feed = 0.0;
    double rpm = 0.0;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();  ///< G92
  };
  struct Stored {
    std::array<Eigen::Vector3d, 6> origins;
    Eigen::Vector3d g28 = Eigen::Vector3d::Zero();
    Eigen::Vector3d g30 = Eigen::Vector3d::Zero();
  };
  friend class SimLine;

  const SimSettings& settings_;
  const SimulatedOptions& options_;
  Modes modes_;
  Stored stored_;
};

}  // namespace lensforge
