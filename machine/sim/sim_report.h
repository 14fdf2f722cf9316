// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace lensforge {

/// Percent of what the program asks for.
struct SimOverrides {
  double feed = 100.0;
  double rapid = 100.0;
  double spindle = 100.0;
};

/// What a realtime byte makes of them; nothing if it is no override.
std::optional<SimOverrides> overridden(SimOverrides before, unsigned char byte);

/// Reports until the next WCO and the next Ov.
struct SimCountdowns {
  int offset = 0;
  int overrides = 1;
};

/// What a status report is written from. Lengths in mm, times in s.
struct SimSnapshot {
  std::string state;
  bool rests = true;  ///< Idle or in alarm: some fields come more often.
  int mask = 0;       ///< $10
  bool inches = false;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< Of the machine.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();    ///< Machine − work.
  int free_blocks = 0;
  std::size_t free_bytes = 0;
  std::int64_t number = 0;  ///< N word of what runs; 0 for none.
  double speed = 0.0;
  double rpm = 0.0;
  bool door_open = false;
  SimOverrides overrides;
  int spindle = 0;  ///< +1, −1, 0
  int coolant = 0;  ///< Bits: 1 mist, 2 flood.
};

/// "<Idle|MPos:…>" with its end, and the countdowns after it.
struct SimReport {
  std::string text;
  SimCountdowns next;
};
SimReport report_of(const SimSnapshot& machine, SimCountdowns countdowns);

}  // namespace lensforge
