// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_line.h"

#include <cmath>

namespace lensforge {
namespace {

constexpr double kLargestLineNumber = 10'000'000.0;

}  // namespace

SimLine::SimLine(const SimGcode& parser, const SimWords& words)
    : modes(parser.modes_),
      stored(parser.stored_),
      settings_(parser.settings_),
      options_(parser.options_),
      words_(words) {}

int SimLine::set_once(std::optional<int>& slot, int code) {
  if (slot) return 21;
  slot = code;
  return 0;
}

int SimLine::sort_g(int code) {
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
      return set_once(special_, code);
    case 0:
    case 10:
    case 20:
    case 30:
    case 800:
      return set_once(motion_, code);
    case 170:
    case 180:
    case 190:
      return set_once(plane_, code);
    case 200:
    case 210:
      return set_once(units_, code);
    case 900:
    case 910:
      return set_once(distance_, code);
    case 930:
    case 940:
      return set_once(feed_mode_, code);
    case 540:
    case 550:
    case 560:
    case 570:
    case 580:
    case 590:
      return set_once(frame_, code);
    case 911:
      return set_once(quiet_[0], code);
    case 400:
      return set_once(quiet_[1], code);
    case 490:
      return set_once(quiet_[2], code);
    case 610:
      return set_once(quiet_[3], code);
    default:
      return 20;
  }
}

int SimLine::sort_m(int code) {
  switch (code) {
    case 0:
    case 10:
    case 20:
    case 300:
      return set_once(stop_, code);
    case 30:
    case 40:
    case 50:
      return set_once(spindle_, code);
    case 60:
      return options_.firmware == SimulatedFirmware::kGrblHal ? set_once(tool_, code) : 20;
    case 70:
      return options_.mist ? set_once(coolant_, code) : 20;
    case 80:
    case 90:
      return set_once(coolant_, code);
    default:
      return 20;
  }
}

int SimLine::sort() {
  for (const int code : words_.g) {
    if (const int error = sort_g(code); error != 0) return error;
  }
  for (const int code : words_.m) {
    if (const int error = sort_m(code); error != 0) return error;
  }
  const auto number = words_['N'];
  if (number && (*number < 0.0 || *number > kLargestLineNumber || *number != std::floor(*number))) {
    return 27;
  }
  for (const char letter : {'F', 'S', 'T'}) {
    if (words_[letter].value_or(0.0) < 0.0) return 4;
  }
  return 0;
}

int SimLine::run() {
  for (const auto step : {&SimLine::sort, &SimLine::set_feed, &SimLine::set_machine,
                          &SimLine::set_dwell, &SimLine::set_frame, &SimLine::non_modal}) {
    if (const int error = (this->*step)(); error != 0) return error;
  }
  if (const int error = refuse_unused(); error != 0) return error;
  set_stop();
  return 0;
}

int SimLine::jog() {
  if (const int error = sort(); error != 0) return error;
  const bool others = motion_ || plane_ || feed_mode_ || frame_ || stop_ || spindle_ || coolant_ ||
                      tool_ || quiet_[0] || quiet_[1] || quiet_[2] || quiet_[3] ||
                      (special_ && *special_ != 530) || words_.any("IJKLPRST");
  if (others || !has_axes()) return others ? 16 : 26;
  if (!words_['F']) return 22;
  if (units_) modes.inches = *units_ == 200;
  if (distance_) modes.absolute = *distance_ == 900;
  jogs_ = true;
  modes.motion = 10;
  modes.inverse_time = false;
  modes.feed = *words_['F'] * scale();
  return plain_motion();
}

int SimLine::set_feed() {
  if (units_) modes.inches = *units_ == 200;
  if (feed_mode_) {
    const bool inverse = *feed_mode_ == 930;
    if (inverse != modes.inverse_time) modes.feed = 0.0;
    modes.inverse_time = inverse;
  }
  use("F");
  if (modes.inverse_time) {
    modes.feed = words_['F'].value_or(0.0);
  } else if (words_['F']) {
    modes.feed = *words_['F'] * scale();
  }
  return 0;
}

int SimLine::set_tool() {
  use("T");
  if (const auto tool = words_['T']) {
    if (*tool > 255.0 || *tool != std::floor(*tool)) return 38;
    modes.tool = static_cast<int>(*tool);
  }
  if (tool_) {
    add(SimAction::Kind::kSync);
    add(SimAction::Kind::kTool);
    actions.back().value = modes.tool;
  }
  return 0;
}

int SimLine::set_machine() {
  const int error = set_tool();
  if (error != 0) return error;
  set_spindle();
  set_coolant();
  return 0;
}

/// A change waits until nothing moves; what does not change costs nothing.
void SimLine::set_spindle() {
  use("S");
  const double rpm = words_['S'].value_or(modes.rpm);
  int turn = modes.spindle;
  if (spindle_) turn = *spindle_ == 30 ? 1 : *spindle_ == 40 ? -1 : 0;
  const bool speed_matters = rpm != modes.rpm && turn != 0;
  if (turn != modes.spindle || speed_matters) {
    add(SimAction::Kind::kSync);
    add(SimAction::Kind::kSpindle);
    actions.back().turn = turn;
    actions.back().value = rpm;
  }
  modes.rpm = rpm;
  modes.spindle = turn;
}

void SimLine::set_coolant() {
  if (!coolant_) return;
  int state = modes.coolant;
  if (*coolant_ == 70) state |= 1;
  if (*coolant_ == 80) state |= 2;
  if (*coolant_ == 90) state = 0;
  if (state == modes.coolant) return;
  modes.coolant = state;
  add(SimAction::Kind::kSync);
  add(SimAction::Kind::kCoolant);
  actions.back().turn = state;
}

int SimLine::set_dwell() {
  if (special_ != 40) return 0;
  if (!words_['P']) return 28;
  if (*words_['P'] < 0.0) return 4;
  use("P");
  add(SimAction::Kind::kSync);
  add(SimAction::Kind::kDwell);
  actions.back().value = *words_['P'];
  return 0;
}

int SimLine::set_frame() {
  if (plane_) modes.plane = *plane_ / 10;
  if (distance_) modes.absolute = *distance_ == 900;
  if (frame_ && modes.origin != *frame_ / 10 - 54) {
    modes.origin = *frame_ / 10 - 54;
    add(SimAction::Kind::kSync);
  }
  if (motion_) modes.motion = *motion_;
  return 0;
}

Eigen::Vector3d SimLine::offset() const {
  return stored.origins[static_cast<std::size_t>(modes.origin)] + modes.shift;
}

Eigen::Vector3d SimLine::target(bool machine) const {
  Eigen::Vector3d target = modes.position;
  const Eigen::Vector3d zero = machine ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : offset();
  for (int axis = 0; axis < 3; ++axis) {
    const auto value = words_["XYZ"[axis]];
    if (!value) continue;
    const bool relative = !machine && !modes.absolute;
    target[axis] = *value * scale() + (relative ? target[axis] : zero[axis]);
  }
  return target;
}

int SimLine::non_modal() {
  const int special = special_.value_or(-1);
  const bool takes_axes = special == 100 || special == 280 || special == 300 || special == 920;
  if (takes_axes && motion_) return 24;
  switch (special) {
    case 40:
      return 0;
    case 100:
      return store_origin();
    case 280:
    case 300:
      return go_home();
    case 281:
    case 301:
      (special == 281 ? stored.g28 : stored.g30) = modes.position;
      add(SimAction::Kind::kStore);
      return 0;
    case 920:
      if (!has_axes()) return 26;
      use("XYZ");
      modes.shift += modes.position - target(false);
      return 0;
    case 921:
      modes.shift.setZero();
      return 0;
    default:
      return plain_motion();
  }
}

/// G10 L2 and L20.
int SimLine::store_origin() {
  const double l = words_['L'].value_or(-1.0);
  if (!words_['P'] || !words_['L']) return 28;
  if (!has_axes()) return 26;
  if ((l != 2.0 && l != 20.0) || *words_['P'] < 0.0 || *words_['P'] > 6.0) return 20;
  const int which = static_cast<int>(*words_['P']);
  const int index = which == 0 ? modes.origin : which - 1;
  Eigen::Vector3d& origin = stored.origins[static_cast<std::size_t>(index)];
  for (int axis = 0; axis < 3; ++axis) {
    const auto value = words_["XYZ"[axis]];
    if (!value) continue;
    origin[axis] =
        l == 2.0 ? *value * scale() : modes.position[axis] - modes.shift[axis] - *value * scale();
  }
  use("LPXYZ");
  add(SimAction::Kind::kStore);
  return 0;
}

int SimLine::go_home() {
  const bool axes = has_axes();
  Eigen::Vector3d last = *special_ == 280 ? stored.g28 : stored.g30;
  SimAction action;
  action.kind = SimAction::Kind::kMove;
  action.move.rapid = true;
  action.move.number = std::llround(words_['N'].value_or(0.0));
  if (axes) {
    use("XYZ");
    action.move.target = modes.position = target(false);
    actions.push_back(action);
    for (int axis = 0; axis < 3; ++axis) {
      if (!words_["XYZ"[axis]]) last[axis] = modes.position[axis];
    }
  }
  action.move.target = modes.position = last;
  actions.push_back(action);
  return 0;
}

int SimLine::plain_motion() {
  const bool machine = special_ == 530;
  const bool arc = modes.motion == 20 || modes.motion == 30;
  if (machine && arc) return 30;
  if (!has_axes()) {
    const bool feeds = motion_ && (modes.motion == 10 || arc);
    if (feeds && modes.feed == 0.0) return 22;
    return motion_ && arc ? 26 : 0;
  }
  if (modes.motion == 800) return 31;
  use("XYZ");
  SimAction action;
  action.kind = SimAction::Kind::kMove;
  action.move.target = target(machine);
  action.move.rapid = modes.motion == 0;
  action.move.jog = jogs_;
  action.move.number = std::llround(words_['N'].value_or(0.0));
  if (arc) {
    if (const int error = arc_motion(action); error != 0) return error;
  }
  if (!action.move.rapid) {
    if (const int error = take_feed(action); error != 0) return error;
  }
  modes.position = action.move.target;
  actions.push_back(action);
  return 0;
}

int SimLine::take_feed(SimAction& action) {
  if (modes.feed == 0.0) return 22;
  action.move.feed = modes.feed;
  if (modes.inverse_time) {
    const double length =
        action.arc ? action.arc->length() : (action.move.target - modes.position).norm();
    action.move.feed *= length;
  }
  return 0;
}

int SimLine::arc_motion(SimAction& action) {
  const std::string_view axes = modes.plane == 17 ? "XY" : modes.plane == 18 ? "XZ" : "YZ";
  const std::string_view offsets = modes.plane == 17 ? "IJ" : modes.plane == 18 ? "IK" : "JK";
  if (!words_.any(axes)) return 32;
  SimArcWords words;
  words.plane = modes.plane;
  words.clockwise = modes.motion == 20;
  words.tolerance = settings_[12];
  if (words_['R']) {
    use("R");
    words.radius = *words_['R'] * scale();
  } else {
    if (!words_.any(offsets)) return 35;
    use(offsets);
    for (int axis = 0; axis < 3; ++axis) {
      words.offset[axis] = words_["IJK"[axis]].value_or(0.0) * scale();
    }
  }
  action.arc.emplace();
  return lay_arc(modes.position, action.move.target, words, *action.arc);
}

int SimLine::refuse_unused() const {
  for (char letter = 'A'; letter <= 'Z'; ++letter) {
    if (words_[letter] && used_.find(letter) == std::string::npos) return 36;
  }
  return 0;
}

void SimLine::set_stop() {
  if (!stop_ || *stop_ == 10) return;
  add(SimAction::Kind::kSync);
  add(*stop_ == 0 ? SimAction::Kind::kPause : SimAction::Kind::kEnd);
  if (*stop_ != 0) restore_defaults();
}

void SimLine::restore_defaults() {
  modes.motion = 10;
  modes.plane = 17;
  modes.absolute = true;
  modes.inverse_time = false;
  modes.origin = 0;
  modes.spindle = 0;
  modes.coolant = 0;
}

}  // namespace lensforge
