// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_line.h"

#include <cmath>
#include <string_view>
#include <utility>

namespace lensforge {
namespace {

using Kind = SimAction::Kind;

SimLineState refused(SimLineState state, int error) {
  state.error = error;
  return state;
}

SimAction& add(SimLineState& state, Kind kind) {
  SimAction& action = state.actions.emplace_back();
  action.kind = kind;
  return action;
}

/// Where the line's axis words lead. @param machine  in machine coordinates (G53).
Eigen::Vector3d target_of(const SimLine& line, const SimLineState& state, bool machine) {
  const SimModes& modes = state.modes;
  Eigen::Vector3d target = modes.position;
  Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  if (!machine) zero = offset_of(modes, state.stored);
  for (int axis = 0; axis < 3; ++axis) {
    const auto value = line.words["XYZ"[axis]];
    if (!value) continue;
    const bool relative = !machine && !modes.absolute;
    target[axis] = *value * modes.scale() + (relative ? target[axis] : zero[axis]);
  }
  return target;
}

/// G10 L2 and L20.
SimLineState store_origin(const SimLine& line, SimLineState state) {
  const auto which = line.words['P'];
  if (!which || !line.words['L']) return refused(std::move(state), 28);
  if (!line.has_axes()) return refused(std::move(state), 26);
  const double l = *line.words['L'];
  if ((l != 2.0 && l != 20.0) || *which < 0.0 || *which > 6.0) return refused(std::move(state), 20);
  const SimModes& modes = state.modes;
  const int index = *which < 1.0 ? modes.origin : static_cast<int>(*which) - 1;
  Eigen::Vector3d& origin = state.stored.origins[static_cast<std::size_t>(index)];
  for (int axis = 0; axis < 3; ++axis) {
    const auto value = line.words["XYZ"[axis]];
    if (!value) continue;
    const double length = *value * modes.scale();
    const double other = modes.shift[axis] + (axis == 2 ? modes.tool_length : 0.0);
    origin[axis] = l == 2.0 ? length : modes.position[axis] - other - length;
  }
  state.used += "LPXYZ";
  add(state, Kind::kStore);
  return state;
}

/// G28 and G30: by way of the axis words to the stored place, in the axes that were named.
SimLineState go_home(const SimLine& line, SimLineState state) {
  Eigen::Vector3d last = line.groups.special == 280 ? state.stored.g28 : state.stored.g30;
  SimAction action;
  action.kind = Kind::kMove;
  action.move.rapid = true;
  action.move.number = std::llround(line.words['N'].value_or(0.0));
  if (line.has_axes()) {
    state.used += "XYZ";
    action.move.target = state.modes.position = target_of(line, state, false);
    state.actions.push_back(action);
    for (int axis = 0; axis < 3; ++axis) {
      if (!line.words["XYZ"[axis]]) last[axis] = state.modes.position[axis];
    }
  }
  action.move.target = state.modes.position = last;
  state.actions.push_back(action);
  return state;
}

/// G28.1 and G30.1.
SimLineState store_home(const SimLine& line, SimLineState state) {
  const bool first = line.groups.special == 281;
  (first ? state.stored.g28 : state.stored.g30) = state.modes.position;
  add(state, Kind::kStore);
  return state;
}

/// G92
SimLineState shift_origin(const SimLine& line, SimLineState state) {
  if (!line.has_axes()) return refused(std::move(state), 26);
  state.used += "XYZ";
  state.modes.shift += state.modes.position - target_of(line, state, false);
  return state;
}

/// G43.1 and G49
SimLineState set_tool_length(const SimLine& line, SimLineState state) {
  const bool states = line.groups.tool_length == 431;
  const bool z_alone = line.words['Z'] && !line.words['X'] && !line.words['Y'];
  if (states && !z_alone) return refused(std::move(state), 37);
  state.used += "XYZ";
  SimModes& modes = state.modes;
  modes.tool_length = states ? *line.words['Z'] * modes.scale() : 0.0;
  return state;
}

struct ArcLaid {
  SimArc arc;
  std::string_view used;  ///< Letters of the words that say where its centre is.
  int error = 0;
};

ArcLaid arc_of(const SimLine& line, const SimModes& modes, const Eigen::Vector3d& target) {
  const std::string_view axes = modes.plane == 17 ? "XY" : modes.plane == 18 ? "XZ" : "YZ";
  const std::string_view offsets = modes.plane == 17 ? "IJ" : modes.plane == 18 ? "IK" : "JK";
  ArcLaid laid;
  SimArcWords words{
      modes.plane, modes.motion == 20, Eigen::Vector3d::Zero(), {}, line.arc_tolerance};
  if (!line.words.any(axes)) {
    laid.error = 32;
  } else if (line.words['R']) {
    laid.used = "R";
    words.radius = *line.words['R'] * modes.scale();
  } else if (line.words.any(offsets)) {
    laid.used = offsets;
    for (int axis = 0; axis < 3; ++axis) {
      words.offset[axis] = line.words["IJK"[axis]].value_or(0.0) * modes.scale();
    }
  } else {
    laid.error = 35;
  }
  if (laid.error == 0) laid.error = lay_arc(modes.position, target, words, laid.arc);
  return laid;
}

/// The feed of a motion, mm/min: in inverse time by its length.
double feed_of(const SimModes& modes, const SimAction& action) {
  if (!modes.inverse_time) return modes.feed;
  const double length =
      action.arc ? action.arc->length() : (action.move.target - modes.position).norm();
  return modes.feed * length;
}

/// A motion word without axis words.
SimLineState no_motion(const SimLine& line, SimLineState state) {
  const bool arc = state.modes.motion == 20 || state.modes.motion == 30;
  const bool feeds = state.modes.motion == 10 || arc;
  if (!line.groups.motion) return state;
  if (feeds && state.modes.feed == 0.0) return refused(std::move(state), 22);
  return arc ? refused(std::move(state), 26) : state;
}

SimLineState move(const SimLine& line, SimLineState state, bool jogs) {
  const bool machine = line.groups.special == 530;
  const bool arc = state.modes.motion == 20 || state.modes.motion == 30;
  if (machine && arc) return refused(std::move(state), 30);
  if (!line.has_axes()) return no_motion(line, std::move(state));
  if (state.modes.motion == 800) return refused(std::move(state), 31);
  state.used += "XYZ";
  SimAction action;
  action.kind = Kind::kMove;
  action.move.target = target_of(line, state, machine);
  action.move.rapid = state.modes.motion == 0;
  action.move.jog = jogs;
  action.move.number = std::llround(line.words['N'].value_or(0.0));
  if (arc) {
    ArcLaid laid = arc_of(line, state.modes, action.move.target);
    if (laid.error != 0) return refused(std::move(state), laid.error);
    state.used += laid.used;
    action.arc = std::move(laid.arc);
  }
  if (!action.move.rapid) {
    if (state.modes.feed == 0.0) return refused(std::move(state), 22);
    action.move.feed = feed_of(state.modes, action);
  }
  state.modes.position = action.move.target;
  state.actions.push_back(std::move(action));
  return state;
}

/// After M2 and M30.
SimModes at_program_end(SimModes modes) {
  modes.motion = 10;
  modes.plane = 17;
  modes.absolute = true;
  modes.inverse_time = false;
  modes.origin = 0;
  modes.spindle = 0;
  modes.coolant = 0;
  return modes;
}

/// Whether a jog's line has words beyond units, distance, G53, axes and feed.
bool beyond_jog(const SimLine& line) {
  const SimGroups& g = line.groups;
  return g.motion || g.plane || g.feed_mode || g.frame || g.stop || g.spindle || g.coolant ||
         g.tool || g.tool_length || g.any_quiet() || (g.special && *g.special != 530) ||
         line.words.any("IJKLPRST");
}

}  // namespace

namespace sim_step {

SimLineState feed(const SimLine& line, SimLineState state) {
  SimModes& modes = state.modes;
  if (line.groups.units) modes.inches = *line.groups.units == 200;
  if (line.groups.feed_mode) {
    const bool inverse = *line.groups.feed_mode == 930;
    if (inverse != modes.inverse_time) modes.feed = 0.0;
    modes.inverse_time = inverse;
  }
  state.used += "F";
  const auto word = line.words['F'];
  if (modes.inverse_time) {
    modes.feed = word.value_or(0.0);
  } else if (word) {
    modes.feed = *word * modes.scale();
  }
  return state;
}

SimLineState tool(const SimLine& line, SimLineState state) {
  constexpr double kLargestTool = 255.0;
  state.used += "T";
  if (const auto tool = line.words['T']) {
    if (*tool > kLargestTool || *tool != std::floor(*tool)) return refused(std::move(state), 38);
    state.modes.tool = static_cast<int>(*tool);
  }
  if (!line.groups.tool) return state;
  add(state, Kind::kSync);
  add(state, Kind::kTool).value = state.modes.tool;
  return state;
}

/// A change waits until nothing moves; what does not change costs nothing.
SimLineState spindle(const SimLine& line, SimLineState state) {
  SimModes& modes = state.modes;
  state.used += "S";
  const double rpm = line.words['S'].value_or(modes.rpm);
  int turn = modes.spindle;
  if (const auto word = line.groups.spindle) turn = *word == 30 ? 1 : *word == 40 ? -1 : 0;
  const bool speed_matters = rpm != modes.rpm && turn != 0;
  if (turn != modes.spindle || speed_matters) {
    add(state, Kind::kSync);
    SimAction& action = add(state, Kind::kSpindle);
    action.turn = turn;
    action.value = rpm;
  }
  modes.rpm = rpm;
  modes.spindle = turn;
  return state;
}

SimLineState coolant(const SimLine& line, SimLineState state) {
  int wanted = state.modes.coolant;
  if (line.groups.coolant == 70) wanted |= 1;
  if (line.groups.coolant == 80) wanted |= 2;
  if (line.groups.coolant == 90) wanted = 0;
  if (wanted == state.modes.coolant) return state;
  state.modes.coolant = wanted;
  add(state, Kind::kSync);
  add(state, Kind::kCoolant).turn = wanted;
  return state;
}

SimLineState dwell(const SimLine& line, SimLineState state) {
  if (line.groups.special != 40) return state;
  const auto seconds = line.words['P'];
  if (!seconds) return refused(std::move(state), 28);
  if (*seconds < 0.0) return refused(std::move(state), 4);
  state.used += "P";
  add(state, Kind::kSync);
  add(state, Kind::kDwell).value = *seconds;
  return state;
}

SimLineState frame(const SimLine& line, SimLineState state) {
  SimModes& modes = state.modes;
  if (line.groups.plane) modes.plane = *line.groups.plane / 10;
  if (line.groups.distance) modes.absolute = *line.groups.distance == 900;
  if (line.groups.frame && modes.origin != *line.groups.frame / 10 - 54) {
    modes.origin = *line.groups.frame / 10 - 54;
    add(state, Kind::kSync);
  }
  if (line.groups.motion) modes.motion = *line.groups.motion;
  return state;
}

SimLineState axes(const SimLine& line, SimLineState state) {
  const int special = line.groups.special.value_or(-1);
  const bool takes_axes = special == 100 || special == 280 || special == 300 || special == 920;
  if (takes_axes && line.groups.motion) return refused(std::move(state), 24);
  if (line.groups.tool_length) {
    const bool moves = line.groups.motion.value_or(800) != 800;
    if (takes_axes || moves) return refused(std::move(state), 24);
    return set_tool_length(line, std::move(state));
  }
  switch (special) {
    case 40:
      return state;
    case 100:
      return store_origin(line, std::move(state));
    case 280:
    case 300:
      return go_home(line, std::move(state));
    case 281:
    case 301:
      return store_home(line, std::move(state));
    case 920:
      return shift_origin(line, std::move(state));
    case 921:
      state.modes.shift.setZero();
      return state;
    default:
      return move(line, std::move(state), false);
  }
}

SimLineState unused(const SimLine& line, SimLineState state) {
  for (char letter = 'A'; letter <= 'Z'; ++letter) {
    if (!line.words[letter] || state.used.find(letter) != std::string::npos) continue;
    return refused(std::move(state), 36);
  }
  return state;
}

SimLineState stop(const SimLine& line, SimLineState state) {
  if (!line.groups.stop || *line.groups.stop == 10) return state;
  const bool pauses = *line.groups.stop == 0;
  add(state, Kind::kSync);
  add(state, pauses ? Kind::kPause : Kind::kEnd);
  if (!pauses) state.modes = at_program_end(state.modes);
  return state;
}

}  // namespace sim_step

SimLineState run_sim_line(const SimLine& line, SimLineState state) {
  state.error = line.groups.error;
  for (const auto step :
       {sim_step::feed, sim_step::tool, sim_step::spindle, sim_step::coolant, sim_step::dwell,
        sim_step::frame, sim_step::axes, sim_step::unused, sim_step::stop}) {
    if (state.error != 0) return state;
    state = step(line, std::move(state));
  }
  return state;
}

SimLineState jog_sim_line(const SimLine& line, SimLineState state) {
  state.error = line.groups.error;
  if (state.error != 0) return state;
  if (beyond_jog(line)) return refused(std::move(state), 16);
  if (!line.has_axes()) return refused(std::move(state), 26);
  if (!line.words['F']) return refused(std::move(state), 22);
  SimModes& modes = state.modes;
  if (line.groups.units) modes.inches = *line.groups.units == 200;
  if (line.groups.distance) modes.absolute = *line.groups.distance == 900;
  modes.motion = 10;
  modes.inverse_time = false;
  modes.feed = *line.words['F'] * modes.scale();
  return move(line, std::move(state), true);
}

}  // namespace lensforge
