// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "machine/sim/sim_gcode.h"

namespace lensforge {

/// One line on its way through copies of the parser's modes and stores, in the order that the
/// Grbl documentation gives for the words of a line.
class SimLine {
 public:
  SimLine(const SimGcode& parser, const SimWords& words);

  int run();
  int jog();

  SimGcode::Modes modes;
  SimGcode::Stored stored;
  std::vector<SimAction> actions;

 private:
  int sort_g(int code);
  int sort_m(int code);
  int set_once(std::optional<int>& slot, int code);
  int sort();
  int set_feed();
  int set_tool();
  int set_machine();
  void set_spindle();
  int set_dwell();
  int set_frame();
  int non_modal();
  int store_origin();
  int go_home();
  int plain_motion();
  int arc_motion(SimAction& action);
  int take_feed(SimAction& action);
  int refuse_unused() const;
  void set_stop();
  void add(SimAction::Kind kind) { actions.emplace_back().kind = kind; }
  void set_coolant();
  void restore_defaults();
  void use(std::string_view letters) { used_ += letters; }
  [[nodiscard]] double scale() const { return modes.inches ? 25.4 : 1.0; }
  [[nodiscard]] Eigen::Vector3d offset() const;
  [[nodiscard]] Eigen::Vector3d target(bool machine) const;
  [[nodiscard]] bool has_axes() const { return words_.any("XYZ"); }

  const SimSettings& settings_;
  const SimulatedOptions& options_;
  const SimWords& words_;
  std::string used_ = "N";
  bool jogs_ = false;
  // Words of the line by modal group, ten times their numbers.
  std::optional<int> special_;
  std::optional<int> motion_;
  std::optional<int> plane_;
  std::optional<int> units_;
  std::optional<int> distance_;
  std::optional<int> feed_mode_;
  std::optional<int> frame_;
  std::optional<int> quiet_[4];
  std::optional<int> stop_;
  std::optional<int> spindle_;
  std::optional<int> coolant_;
  std::optional<int> tool_;
};

}  // namespace lensforge
