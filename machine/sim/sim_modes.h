// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>

#include "machine/sim/sim_arc.h"
#include "machine/sim/sim_queue.h"

namespace lensforge {

/// What is in force in the firmware's parser. A value: a line makes a new one of it.
struct SimModes {
  int motion = 0;  ///< Ten times the word.
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

/// What the firmware keeps in its EEPROM for G-code.
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

}  // namespace lensforge
