// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_gcode.h"

#include "machine/sim/sim_text.h"

namespace lensforge {

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
