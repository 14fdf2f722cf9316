// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "machine/sim/sim_groups.h"
#include "machine/sim/sim_modes.h"
#include "machine/sim/sim_words.h"

namespace lensforge {

/// One line as it was read.
struct SimLine {
  SimWords words;
  SimGroups groups;
  double arc_tolerance = 0.002;  ///< $12, mm

  [[nodiscard]] bool has_axes() const { return words.any("XYZ"); }
};

/// The parser on its way through a line: each step takes one and gives the next.
struct SimLineState {
  SimModes modes;
  SimStored stored;
  std::vector<SimAction> actions;  ///< What the line makes the controller do so far.
  std::string used = "N";          ///< Letters of words that a step took up.
  int error = 0;                   ///< Number of the error that ends the line here, or 0.
};

/// The steps of a line. @pre state.error == 0
namespace sim_step {
SimLineState feed(const SimLine& line, SimLineState state);     ///< G20 G21 G93 G94 F
SimLineState tool(const SimLine& line, SimLineState state);     ///< T M6
SimLineState spindle(const SimLine& line, SimLineState state);  ///< S M3 M4 M5
SimLineState coolant(const SimLine& line, SimLineState state);  ///< M7 M8 M9
SimLineState dwell(const SimLine& line, SimLineState state);    ///< G4
/// G17 G18 G19 G90 G91 G54 … G59, and the motion that is in force from here on.
SimLineState frame(const SimLine& line, SimLineState state);
/// What the axis words are for: G10 G28 G30 G92, or a motion.
SimLineState axes(const SimLine& line, SimLineState state);
SimLineState unused(const SimLine& line, SimLineState state);  ///< Refuses words that nobody took.
SimLineState stop(const SimLine& line, SimLineState state);    ///< M0 M1 M2 M30
}  // namespace sim_step

/// Runs a line through all steps, in the order that the Grbl documentation gives for its words,
/// until one ends it. @param state  of the parser before it.
SimLineState run_sim_line(const SimLine& line, SimLineState state);

/// Runs the part of `$J=` behind the sign.
SimLineState jog_sim_line(const SimLine& line, SimLineState state);

}  // namespace lensforge
