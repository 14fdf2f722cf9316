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

/// State reported by a controller.
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
  int blocks = 0;  ///< Free blocks of the planner.
  int bytes = 0;   ///< Free bytes of the receive buffer.
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
  std::optional<double> measured_rpm;          ///< Third number of FS, grblHAL with an encoder.
  std::string pins;                            ///< Pn: triggered inputs.
  std::optional<Eigen::Vector3i> overrides;    ///< Ov: feed, rapids, spindle, %.
  std::optional<std::string> accessories;      ///< A: S or C spindle, F flood, M mist.
  std::optional<bool> homed;                   ///< H of grblHAL.
  std::vector<std::string> others;             ///< Well-formed unknown fields.
};

/// Reads "<Idle|MPos:0.000,0.000,0.000|…>". Strict: empty unless the state, exactly one position
/// and every known field have the controllers' format.
std::optional<StatusReport> parse_status_report(std::string_view line);

/// "error:22: no feed has been set"; for undocumented numbers it says that neither Grbl 1.1 nor
/// grblHAL documents them.
std::string explain_error(int code);

/// "ALARM:1: a limit switch …", in the same form.
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
    kStartup,  ///< ">…:ok": a start-up line has run.
    kBanner,   ///< "Grbl 1.1f ['$' for help]": the controller has restarted.
    kEmpty,    ///< An empty line.
    kUnknown,  ///< Anything else.
  };
  Kind kind = Kind::kUnknown;
  std::string text;                    ///< The line without its end.
  int code = 0;                        ///< Of kError and kAlarm.
  std::string name;                    ///< Of kData ("GC", "OPT") and kSetting ("30", "N0").
  std::string value;                   ///< Text after the name; the message of kMessage.
  std::optional<StatusReport> status;  ///< Of kStatus.
};

/// Parses a line. Strict: anything that Grbl 1.1 and grblHAL do not write is kUnknown.
/// @param line  without its end.
Reply parse_reply(std::string_view line);

/// Splits a stream of bytes into lines (LF, or CR LF) and parses them.
class ReplyReader {
 public:
  /// Longer lines, which no controller sends, are truncated to this length and kUnknown.
  static constexpr std::size_t kLongestLine = 1024;

  /// Passes every completed line to `take`, in order. Keeps the remaining bytes.
  void feed(std::string_view bytes, const std::function<void(const Reply&)>& take);
  /// Drops an incomplete line.
  void clear() { line_.clear(); }

 private:
  std::string line_;
  bool too_long_ = false;
};

}  // namespace lensforge
