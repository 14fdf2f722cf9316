// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "machine/gcode/gcode_dialect.h"
#include "machine/gcode/gcode_motion.h"
#include "machine/link/link.h"
#include "machine/stream/reply_parser.h"

namespace lensforge {

/// Why a stream was stopped.
enum class StopCause {
  kNone,
  kInterrupted,      ///< Somebody asked for it.
  kGarbledReply,     ///< A reply that no controller sends.
  kCountMismatch,    ///< More or fewer replies than lines.
  kError,            ///< The controller refused a line.
  kAlarm,            ///< The controller is in alarm.
  kReset,            ///< The controller started afresh.
  kStall,            ///< No answer, or no motion and no answer.
  kLinkLost,         ///< Unplugged, closed.
  kDoor,             ///< The controller reports its safety door open.
  kHeld,             ///< Held from outside for longer than allowed.
  kUnexpectedState,  ///< Somebody homes, jogs, checks or puts the controller to sleep.
  kSpindle,          ///< Not at speed, failed, or not to be verified.
  kInterlock,        ///< Door, vacuum, coolant, e-stop on the bus.
  kJournal,          ///< The journal cannot be kept.
  kProgram,          ///< The program cannot be read on, or was changed.
};

/// "garbled reply", "link lost" …
std::string_view cause_name(StopCause cause);

/// A reason to stop the stream, on its way to the place that stops it.
class StreamFault : public std::runtime_error {
 public:
  StreamFault(StopCause cause, const std::string& reason)
      : std::runtime_error(reason), cause_(cause) {}
  [[nodiscard]] StopCause cause() const { return cause_; }

 private:
  StopCause cause_;
};

/// Bytes on which a Grbl-family controller acts at once, wherever in the stream they stand.
namespace realtime {
inline constexpr char kStatusReport = '?';
inline constexpr char kFeedHold = '!';
inline constexpr char kCycleStart = '~';
inline constexpr char kSoftReset = '\x18';
inline constexpr char kFeedTo100 = '\x90';
inline constexpr char kFeedUp10 = '\x91';
inline constexpr char kFeedDown10 = '\x92';
inline constexpr char kRapidTo100 = '\x95';
inline constexpr char kRapidTo50 = '\x96';
inline constexpr char kRapidTo25 = '\x97';
inline constexpr char kSpindleTo100 = '\x99';
inline constexpr char kSpindleUp10 = '\x9A';
inline constexpr char kSpindleDown10 = '\x9B';
}  // namespace realtime

/// Lines out, replies in. What the link does not take at once waits here; realtime bytes pass it
/// by.
class Wire {
 public:
  /// @param link  must outlive the wire.
  explicit Wire(Link& link) : link_(link) {}

  /// Puts a line, which gets its end here, behind those that wait.
  void line(std::string_view text);
  /// Sends a realtime byte, ahead of all that waits. @throw LinkLost
  void urgent(char byte);
  /// Writes as much as the link takes. @throw LinkLost
  void flush();
  /// Whether something waits to be written.
  [[nodiscard]] bool waiting() const { return written_ < lines_.size() || !urgent_.empty(); }
  /// Drops all lines and parts of lines that were not written; realtime bytes stay.
  void discard();
  /// Waits at most `wait` seconds for bytes and hands on the replies that they complete.
  /// @throw LinkLost, and whatever `take` throws
  void receive(double wait, const std::function<void(const Reply&)>& take);

 private:
  Link& link_;
  ReplyReader reader_;
  std::string urgent_;
  std::string lines_;
  std::size_t written_ = 0;  ///< Bytes of lines_ that are gone.
};

/// What a controller tells of itself before a job.
struct ControllerInfo {
  std::string banner;
  std::string version;  ///< [VER:…]
  std::string options;  ///< Letters of [OPT:…].
  GcodeDialect dialect;
  int rx_bytes = 0;                ///< Of the receive buffer that may be filled.
  int planner_blocks = 0;          ///< Motions that it looks ahead.
  bool reports_room = false;       ///< Bf: stands in its reports.
  bool line_numbers = false;       ///< It reports Ln:.
  std::map<int, double> settings;  ///< $N=value, numbers only.
  StatusReport status;             ///< The last one, while it stood still.
  GcodeState start;                ///< Where the tool is; where the coordinate systems begin.

  [[nodiscard]] std::optional<double> setting(int number) const;
  [[nodiscard]] bool inches() const { return setting(13).value_or(0.0) != 0.0; }
  /// mm in one unit of its reports.
  [[nodiscard]] double report_unit() const { return inches() ? 25.4 : 1.0; }
  /// Machine position of a report, mm; nothing if it tells the work position and no offset is
  /// known.
  [[nodiscard]] std::optional<Eigen::Vector3d> machine_position(const StatusReport& report) const;
};

/// Questions and answers while no job runs. Firmware before Grbl 1.1, which reports in another
/// form, is refused by all with an InputError that names it.
class Dialogue {
 public:
  Dialogue(Wire& wire, Clock& clock, std::stop_token stop)
      : wire_(wire), clock_(clock), stop_(std::move(stop)) {}

  /// Asks until a report comes or the time is over. @throw StreamFault for a request to stop.
  std::optional<StatusReport> ask_status(double timeout);
  /// What to say if there is none. @throw StreamFault kStall
  [[noreturn]] static void silence();
  /// Sends a line and waits for its ok. @return what came before it.
  /// @throw StreamFault for an error, an alarm, nonsense, silence or a request to stop.
  std::vector<Reply> ask(const std::string& line, double timeout);
  /// A report that was asked for now. @throw StreamFault
  StatusReport status(double timeout = 3.0);
  /// Soft reset, and what the controller says of itself. @pre nothing moves. @throw StreamFault
  std::string reset(double timeout = 10.0);
  /// reset(), empty where no answer comes.
  std::string try_reset(double timeout);
  /// Feed hold, until nothing moves any more. @throw StreamFault
  StatusReport hold(double timeout = 20.0);

 private:
  void pause_until_reply(double until);
  void take(const Reply& reply);

  Wire& wire_;
  Clock& clock_;
  std::stop_token stop_;
  std::vector<Reply> replies_;
};

/// Whether a report says that nothing moves.
bool at_rest(const StatusReport& report);

/// Asks for build, settings and coordinate systems. @pre the controller is idle or in alarm.
/// @throw StreamFault; InputError if it is none of the Grbl family.
ControllerInfo learn_controller(Dialogue& dialogue, const std::string& banner);

}  // namespace lensforge
