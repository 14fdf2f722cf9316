// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
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

/// "error:22: no feed has been set"; for numbers that neither Grbl 1.1 nor grblHAL documents, that.
std::string explain_error(int code);

/// "ALARM:1: a limit switch …", likewise.
std::string explain_alarm(int code);

/// One line from a Grbl-family controller.
struct Reply {
  enum class Kind {
    kOk,       ///< "ok": a line was taken.
    kError,    ///< "error:N": a line was refused.
    kAlarm,    ///< "ALARM:N"
    kStatus,   ///< "<…>"
    kMessage,  ///< "[MSG:…]"
    kData,     ///< "[NAME:…]": answers to $G, $#, $I …
    kSetting,  ///< "$N=value", also of a start-up line, "$N0=…"
    kStartup,  ///< ">…:ok": a start-up line was run.
    kBanner,   ///< "Grbl 1.1f ['$' for help]": the controller has started afresh.
    kEmpty,    ///< Nothing but the line's end.
    kUnknown,  ///< Anything else: never guessed at.
  };
  Kind kind = Kind::kUnknown;
  std::string text;                    ///< The line without its end.
  int code = 0;                        ///< Of kError and kAlarm.
  std::string name;                    ///< Of kData ("GC", "OPT") and kSetting ("30", "N0").
  std::string value;                   ///< What follows the name; of kMessage the message.
  std::optional<StatusReport> status;  ///< Of kStatus.
};

/// Strict: whatever differs from what Grbl 1.1 and grblHAL write is kUnknown.
/// @param line  without its end.
Reply parse_reply(std::string_view line);

/// Cuts a stream of bytes into lines (LF, or CR LF) and parses them.
class ReplyReader {
 public:
  /// Longer lines, which no controller sends, come out as kUnknown, cut here.
  static constexpr std::size_t kLongestLine = 1024;

  /// Hands every line that `bytes` complete to `take`, in order. Keeps the remaining bytes.
  void feed(std::string_view bytes, const std::function<void(const Reply&)>& take);
  /// Drops the line that has begun.
  void clear() { line_.clear(); }

 private:
  std::string line_;
  bool too_long_ = false;
};

}  // namespace lensforge
