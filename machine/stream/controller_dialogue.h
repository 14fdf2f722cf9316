// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <istream>
#include <map>
#include <optional>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "core/compute/executor.h"
#include "machine/gcode/gcode_dialect.h"
#include "machine/gcode/gcode_motion.h"
#include "machine/link/link.h"
#include "machine/stream/reply_parser.h"

namespace lensforge {

/// Between two ? while a controller answers: five a second, s.
inline constexpr double kStatusPause = 0.2;

/// Reason for stopping a stream.
enum class StopCause {
  kNone,
  kInterrupted,      ///< Requested by the operator or a signal.
  kGarbledReply,     ///< An invalid reply.
  kCountMismatch,    ///< More or fewer replies than lines.
  kError,            ///< The controller refused a line.
  kAlarm,            ///< The controller is in alarm.
  kReset,            ///< The controller restarted.
  kStall,            ///< No answer, or no motion and no answer.
  kLinkLost,         ///< Unplugged, closed.
  kDoor,             ///< The controller reports its safety door open.
  kHeld,             ///< Held from outside for longer than allowed.
  kUnexpectedState,  ///< Homing, jog, check mode or sleep, started elsewhere.
  kSpindle,          ///< Not at speed, failed, or not verifiable.
  kInterlock,        ///< An interlock on the bus: door, vacuum, coolant, e-stop.
  kJournal,          ///< The journal cannot be written.
  kProgram,          ///< The program cannot be read further or was changed.
};

/// "garbled reply", "link lost" …
std::string_view cause_name(StopCause cause);

/// Thrown to stop the stream.
class StreamFault : public std::runtime_error {
 public:
  StreamFault(StopCause cause, const std::string& reason)
      : std::runtime_error(reason), cause_(cause) {}
  [[nodiscard]] StopCause cause() const { return cause_; }

 private:
  StopCause cause_;
};

/// Realtime bytes: a Grbl-family controller acts on them at once, anywhere in the stream.
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

/// Sends lines and receives replies. Bytes that the link does not accept at once are queued;
/// realtime bytes overtake them.
class Wire {
 public:
  /// @param link  must outlive the wire.
  explicit Wire(Link& link) : link_(link) {}

  /// Appends a line to the queue and adds its line end.
  void line(std::string_view text);
  /// Sends a realtime byte ahead of the queue. @throw LinkLost
  void urgent(char byte);
  /// Writes as much as the link accepts. @throw LinkLost
  void flush();
  /// True if something is queued.
  [[nodiscard]] bool waiting() const { return written_ < lines_.size() || !urgent_.empty(); }
  /// Drops all unwritten lines and parts of lines; realtime bytes stay.
  void discard();
  /// Waits at most `wait` seconds for bytes and passes completed replies to `take`. @throw
  /// LinkLost, and what `take` throws
  void receive(double wait, const std::function<void(const Reply&)>& take);

 private:
  Link& link_;
  ReplyReader reader_;
  std::string urgent_;
  std::string lines_;
  std::size_t written_ = 0;  ///< Number of bytes of lines_ already written.
};

/// Properties of a controller, read before a job.
struct ControllerInfo {
  std::string banner;
  std::string version;  ///< [VER:…]
  std::string options;  ///< Letters of [OPT:…].
  GcodeDialect dialect;
  int rx_bytes = 0;                ///< Usable size of the receive buffer.
  int planner_blocks = 0;          ///< Number of look-ahead motions.
  bool reports_room = false;       ///< Its reports have Bf:.
  bool line_numbers = false;       ///< It reports Ln:.
  std::map<int, double> settings;  ///< $N=value, numbers only.
  StatusReport status;             ///< Latest report at rest.
  GcodeState start;                ///< Tool position and coordinate origins.

  [[nodiscard]] std::optional<double> setting(int number) const;
  [[nodiscard]] bool inches() const { return setting(13).value_or(0.0) != 0.0; }
  /// Unit of its reports, mm.
  [[nodiscard]] double report_unit() const { return inches() ? 25.4 : 1.0; }
  /// Machine position of a report, mm; empty if it gives the work position and the offset is
  /// unknown.
  [[nodiscard]] std::optional<Eigen::Vector3d> machine_position(const StatusReport& report) const;
};

/// Dialogue with the controller while no job runs. Every function refuses firmware before Grbl 1.1,
/// which has another report format, with an InputError that names it.
class Dialogue {
 public:
  Dialogue(Wire& wire, Clock& clock, std::stop_token stop)
      : wire_(wire), clock_(clock), stop_(std::move(stop)) {}

  /// Asks until a report arrives or the time is up. @throw StreamFault for a request to stop.
  std::optional<StatusReport> ask_status(double timeout);
  /// Reports that no answer came. @throw StreamFault kStall
  [[noreturn]] static void silence();
  /// Sends a line and waits for its ok. @return the replies before it.
  /// @throw StreamFault for an error, an alarm, an invalid reply, silence or a request to stop.
  std::vector<Reply> ask(const std::string& line, double timeout);
  /// Asks for a new report. @throw StreamFault
  StatusReport status(double timeout = 3.0);
  /// Soft reset; returns the controller's banner. @pre nothing moves. @throw StreamFault
  std::string reset(double timeout = 10.0);
  /// Like reset(), but returns an empty string if there is no answer.
  std::string try_reset(double timeout);
  /// Feed hold; waits until nothing moves. @throw StreamFault
  StatusReport hold(double timeout = 20.0);

 private:
  void pause_until_reply(double until);
  void take(const Reply& reply);

  Wire& wire_;
  Clock& clock_;
  std::stop_token stop_;
  std::vector<Reply> replies_;
};

/// True if a report states that nothing moves.
bool at_rest(const StatusReport& report);

/// Reads build, settings and coordinate systems. @pre the controller is idle or in alarm. @throw
/// StreamFault; InputError if it is not of the Grbl family.
ControllerInfo learn_controller(Dialogue& dialogue, const std::string& banner);

/// Options for taking over a controller.
struct SessionOptions {
  /// After a fault: hold and reset a machine that moves or is in a hold.
  bool resume = false;
  bool home = false;  ///< Run the homing cycle.
  /// Limit for the first answer, s: boards that restart when the port is opened take two seconds. A
  /// silent board is detected within 3 s, also with homing.
  double wake_timeout = 2.4;
  double home_timeout = 300.0;
};

/// Takes over a controller: waits for it, soft-resets it (which keeps the position if nothing
/// moves, and drops a partial line of an earlier sender), homes if requested, and reads its
/// properties.
/// @throw InputError if it moves, is held or has its door open; StreamFault; LinkLost
ControllerInfo open_session(Wire& wire, Clock& clock, const SessionOptions& options,
                            const std::stop_token& stop);

/// Time from a line to its ok, s: the median of several empty lines. @throw StreamFault
double measure_round_trip(Wire& wire, Clock& clock, const std::stop_token& stop);

/// Lets the controller check every line without moving ($C). However the check ends, the controller
/// then is out of check mode and reset. @return number of lines checked. @throw StreamFault naming
/// the line, or the part that does not answer; GcodeError; LinkLost, after which it may still be in
/// check mode
std::int64_t check_on_controller(Wire& wire, Clock& clock, std::istream& program,
                                 const ControllerInfo& info, const RunControl& control);

}  // namespace lensforge
