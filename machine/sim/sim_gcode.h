// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "machine/sim/sim_line.h"
#include "machine/sim/sim_settings.h"

namespace lensforge {

/// The firmware's G-code parser: it keeps modes and stores from line to line (sim_line.h).
class SimGcode {
 public:
  SimGcode(const SimSettings& settings, const SimulatedOptions& options)
      : settings_(settings), options_(options) {}

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
