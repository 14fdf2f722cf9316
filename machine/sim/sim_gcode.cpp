// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_gcode.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>

#include "machine/sim/sim_firmware.h"

namespace lensforge {
namespace {

/// A decimal number at `at`, which moves behind it; nothing if there is none.
std::optional<double> read_number(std::string_view line, std::size_t& at) {
  const bool minus = at < line.size() && line[at] == '-';
  if (at < line.size() && (line[at] == '-' || line[at] == '+')) ++at;
  double value = 0.0;
  double scale = 1.0;
  bool point = false;
  bool any = false;
  for (; at < line.size(); ++at) {
    const char c = line[at];
    if (c == '.' && !point) {
      point = true;
    } else if (c >= '0' && c <= '9') {
      any = true;
      value = 10.0 * value + (c - '0');
      if (point) scale *= 10.0;
    } else {
      break;
    }
  }
  if (!any) return std::nullopt;
  return (minus ? -value : value) / scale;
}

int add_word(char letter, double value, SimWords& words) {
  if (letter == 'G' || letter == 'M') {
    const double tenths = std::round(value * 10.0);
    if (std::abs(tenths - value * 10.0) > 1e-6) return 23;
    (letter == 'G' ? words.g : words.m).push_back(static_cast<int>(tenths));
    return 0;
  }
  if (std::string_view("FIJKLNPRSTXYZ").find(letter) == std::string_view::npos) return 20;
  auto& slot = words.values[static_cast<std::size_t>(letter - 'A')];
  if (slot) return 25;
  slot = value;
  return 0;
}

}  // namespace

bool SimWords::any(std::string_view letters) const {
  for (const char letter : letters) {
    if ((*this)[letter]) return true;
  }
  return false;
}

int split_words(std::string_view line, SimWords& words) {
  std::size_t at = 0;
  while (at < line.size()) {
    const char letter = line[at++];
    if (letter < 'A' || letter > 'Z') return 1;
    const auto value = read_number(line, at);
    if (!value) return 2;
    if (const int error = add_word(letter, *value, words); error != 0) return error;
  }
  return 0;
}

namespace {

using Slot = std::optional<int> SimGroups::*;

constexpr double kLargestLineNumber = 10'000'000.0;

/// The group of a G word that is one of a kind; null for one that is quiet or unknown.
Slot group_of_g(int code) {
  switch (code) {
    case 40:
    case 100:
    case 280:
    case 281:
    case 300:
    case 301:
    case 530:
    case 920:
    case 921:
      return &SimGroups::special;
    case 0:
    case 10:
    case 20:
    case 30:
    case 800:
      return &SimGroups::motion;
    case 170:
    case 180:
    case 190:
      return &SimGroups::plane;
    case 200:
    case 210:
      return &SimGroups::units;
    case 900:
    case 910:
      return &SimGroups::distance;
    case 930:
    case 940:
      return &SimGroups::feed_mode;
    case 431:
    case 490:
      return &SimGroups::tool_length;
    case 540:
    case 550:
    case 560:
    case 570:
    case 580:
    case 590:
      return &SimGroups::frame;
    default:
      return nullptr;
  }
}

/// Null for a word that this firmware build does not know.
Slot group_of_m(int code, const SimulatedOptions& options) {
  switch (code) {
    case 0:
    case 10:
    case 20:
    case 300:
      return &SimGroups::stop;
    case 30:
    case 40:
    case 50:
      return &SimGroups::spindle;
    case 60:
      return options.firmware == SimulatedFirmware::kGrblHal ? &SimGroups::tool : nullptr;
    case 70:
      return options.mist ? &SimGroups::coolant : nullptr;
    case 80:
    case 90:
      return &SimGroups::coolant;
    default:
      return nullptr;
  }
}

/// The place of a G word that is taken and changes nothing, each a group of its own.
std::optional<int>* quiet_slot(int code, SimGroups& groups) {
  constexpr std::array kQuiet = {911, 400, 610};
  const auto found = std::find(kQuiet.begin(), kQuiet.end(), code);
  if (found == kQuiet.end()) return nullptr;
  return &groups.quiet[static_cast<std::size_t>(found - kQuiet.begin())];
}

int set_once(std::optional<int>* slot, int code) {
  if (slot == nullptr) return 20;
  if (*slot) return 21;
  *slot = code;
  return 0;
}

int check_numbers(const SimWords& words) {
  const auto number = words['N'];
  if (number && (*number < 0.0 || *number > kLargestLineNumber || *number != std::floor(*number))) {
    return 27;
  }
  for (const char letter : {'F', 'S', 'T'}) {
    if (words[letter].value_or(0.0) < 0.0) return 4;
  }
  return 0;
}

}  // namespace

bool SimGroups::any_quiet() const {
  return std::any_of(quiet.begin(), quiet.end(), [](const auto& word) { return word.has_value(); });
}

SimGroups group_words(const SimWords& words, const SimulatedOptions& options) {
  SimGroups groups;
  for (const int code : words.g) {
    const Slot slot = group_of_g(code);
    groups.error = set_once(slot != nullptr ? &(groups.*slot) : quiet_slot(code, groups), code);
    if (groups.error != 0) return groups;
  }
  for (const int code : words.m) {
    const Slot slot = group_of_m(code, options);
    groups.error = set_once(slot != nullptr ? &(groups.*slot) : nullptr, code);
    if (groups.error != 0) return groups;
  }
  groups.error = check_numbers(words);
  return groups;
}

namespace {

using Plane = std::complex<double>;
constexpr double kTurn = 2.0 * std::numbers::pi;

int real_axis(int plane) { return plane == 17 ? 0 : plane == 18 ? 2 : 1; }
int imaginary_axis(int plane) { return plane == 17 ? 1 : plane == 18 ? 0 : 2; }
int normal_axis(int plane) { return plane == 17 ? 2 : plane == 18 ? 1 : 0; }

Plane flat(const Eigen::Vector3d& point, int plane) {
  return {point[real_axis(plane)], point[imaginary_axis(plane)]};
}

/// The turn from one arm to the other, never nothing.
double turn_between(Plane from, Plane to, bool clockwise) {
  double turn = std::arg(to / from);
  if (clockwise && turn >= -5e-7) turn -= kTurn;
  if (!clockwise && turn <= 5e-7) turn += kTurn;
  return turn;
}

/// Centre = middle + i·h·chord/|chord|; h > 0 puts it on the left.
int centre_by_radius(Plane start, Plane end, const SimArcWords& words, Plane& centre) {
  const Plane chord = end - start;
  if (std::abs(chord) == 0.0) return 33;
  const double r = *words.radius;
  const double square = 4.0 * r * r - std::norm(chord);
  if (square < -1e-9 * std::norm(chord)) return 34;
  double h = 0.5 * std::sqrt(std::max(0.0, square));
  if (words.clockwise != (r < 0.0)) h = -h;
  centre = 0.5 * (start + end) + Plane(0.0, h) * chord / std::abs(chord);
  return 0;
}

bool radii_differ(double first, double second) {
  const double error = std::abs(first - second);
  return error > 0.005 && (error > 0.5 || error > 0.001 * first);
}

}  // namespace

Eigen::Vector3d SimArc::chord_end(int chord) const {
  if (chord >= chords) return end;
  const double share = double(chord) / chords;
  const Plane middle = flat(centre, plane);
  const Plane point = middle + (flat(start, plane) - middle) * std::polar(1.0, turn * share);
  Eigen::Vector3d result;
  result[real_axis(plane)] = point.real();
  result[imaginary_axis(plane)] = point.imag();
  const int normal = normal_axis(plane);
  result[normal] = start[normal] + share * (end[normal] - start[normal]);
  return result;
}

double SimArc::length() const {
  const double radius = std::abs(flat(start, plane) - flat(centre, plane));
  const int normal = normal_axis(plane);
  return std::hypot(radius * turn, end[normal] - start[normal]);
}

int lay_arc(const Eigen::Vector3d& start, const Eigen::Vector3d& end, const SimArcWords& words,
            SimArc& arc) {
  arc.start = start;
  arc.end = end;
  arc.plane = words.plane;
  const Plane from = flat(start, words.plane);
  const Plane to = flat(end, words.plane);
  Plane centre = from + flat(words.offset, words.plane);
  if (words.radius) {
    if (const int error = centre_by_radius(from, to, words, centre); error != 0) return error;
  } else if (std::abs(from - centre) == 0.0 ||
             radii_differ(std::abs(from - centre), std::abs(to - centre))) {
    return 33;
  }
  arc.centre[real_axis(words.plane)] = centre.real();
  arc.centre[imaginary_axis(words.plane)] = centre.imag();
  arc.turn = turn_between(from - centre, to - centre, words.clockwise);
  const double radius = std::abs(from - centre);
  const double half_chord = std::sqrt(words.tolerance * (2.0 * radius - words.tolerance));
  const double count = std::abs(0.5 * arc.turn * radius) / half_chord;
  arc.chords = half_chord > 0.0 ? std::max(1, static_cast<int>(count)) : 1;
  return 0;
}

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

/// Target of the line's axis words. @param machine  in machine coordinates (G53).
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

/// True if a jog's line has words other than units, distance, G53, axes and feed.
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

SimLine SimGcode::read(const SimWords& words) const {
  return {words, group_words(words, options_), settings_[12]};
}

int SimGcode::run(std::string_view line, std::vector<SimAction>& actions) {
  SimWords words;
  if (const int error = split_words(line, words); error != 0) return error;
  const SimLineState after = run_sim_line(read(words), state());
  if (after.error != 0) return after.error;
  modes_ = after.modes;
  stored_ = after.stored;
  actions.insert(actions.end(), after.actions.begin(), after.actions.end());
  return 0;
}

int SimGcode::jog(std::string_view line, std::vector<SimAction>& actions) {
  SimWords words;
  if (const int error = split_words(line, words); error != 0) return error;
  const SimLineState after = jog_sim_line(read(words), state());
  if (after.error != 0) return after.error;
  modes_.position = after.modes.position;
  actions.insert(actions.end(), after.actions.begin(), after.actions.end());
  return 0;
}

void SimGcode::reset() {
  const Eigen::Vector3d position = modes_.position;
  modes_ = SimModes();
  modes_.position = position;
}

std::string SimGcode::state_text() const {
  std::string text = numbered("[GC:G", modes_.motion / 10);
  text.append(" G").append(std::to_string(54 + modes_.origin));
  text.append(" G").append(std::to_string(modes_.plane));
  text.append(modes_.inches ? " G20" : " G21").append(modes_.absolute ? " G90" : " G91");
  text.append(modes_.inverse_time ? " G93" : " G94");
  text.append(modes_.spindle == 0 ? " M5" : modes_.spindle > 0 ? " M3" : " M4");
  if ((modes_.coolant & 1) != 0) text.append(" M7");
  if ((modes_.coolant & 2) != 0) text.append(" M8");
  if (modes_.coolant == 0) text.append(" M9");
  text.append(" T").append(std::to_string(modes_.tool));
  text.append(" F").append(fixed_text(modes_.feed, 0));
  text.append(" S").append(fixed_text(modes_.rpm, 0)).append("]\r\n");
  return text;
}

std::string SimGcode::parameters_text() const {
  std::string text;
  const auto line = [&text](const std::string& name, const Eigen::Vector3d& value) {
    text.append("[").append(name).append(":").append(fixed_text(value, 3)).append("]\r\n");
  };
  for (std::size_t i = 0; i < stored_.origins.size(); ++i) {
    line(std::string("G").append(std::to_string(54 + i)), stored_.origins[i]);
  }
  line("G28", stored_.g28);
  line("G30", stored_.g30);
  line("G92", modes_.shift);
  text.append("[TLO:").append(fixed_text(modes_.tool_length, 3));
  text.append("]\r\n[PRB:0.000,0.000,0.000:0]\r\n");
  return text;
}

}  // namespace lensforge
