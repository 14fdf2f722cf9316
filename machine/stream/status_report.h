// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// What a controller says that it is doing.
enum class ReportedState {
  kIdle,
  kRun,
  kHold,
  kJog,
  kAlarm,
  kDoor,
  kCheck,
  kHome,
  kSleep,
  kTool,  ///< grblHAL: waits for a tool to be changed.
};

/// "Idle", "Run" …
std::string_view state_name(ReportedState state);

/// Free room in a controller's buffers.
struct BufferRoom {
  int blocks = 0;  ///< Motions that the planner can still take.
  int bytes = 0;   ///< Of the receive buffer.
};

/// One answer to ?. Lengths and speeds are in the controller's reporting unit: mm, or inch
/// under $13=1.
struct StatusReport {
  ReportedState state = ReportedState::kIdle;
  std::optional<int> sub_state;  ///< Hold:0 … Door:3, Alarm:N of grblHAL.
  std::optional<Eigen::Vector3d> machine_position;
  std::optional<Eigen::Vector3d> work_position;
  std::optional<Eigen::Vector3d> work_offset;  ///< WCO: machine − work position.
  std::optional<BufferRoom> room;              ///< Bf
  std::optional<std::int64_t> line;            ///< Ln: N word of the motion in progress.
  std::optional<double> feed;                  ///< F, FS
  std::optional<double> spindle_rpm;           ///< FS: as commanded.
  std::optional<double> measured_rpm;          ///< FS's third number, grblHAL with an encoder.
  std::string pins;                            ///< Pn: inputs that are triggered.
  std::optional<Eigen::Vector3i> overrides;    ///< Ov: feed, rapids, spindle, %.
  std::optional<std::string> accessories;      ///< A: S or C spindle, F flood, M mist.
  std::optional<bool> homed;                   ///< H of grblHAL.
  std::vector<std::string> others;             ///< Well-formed fields that mean nothing here.
};

/// Reads "<Idle|MPos:0.000,0.000,0.000|…>". Strict: nothing unless the state, exactly one position
/// and every known field are as the controllers write them.
std::optional<StatusReport> parse_status_report(std::string_view line);

}  // namespace lensforge
