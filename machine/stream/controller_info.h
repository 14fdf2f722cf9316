// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "machine/gcode/gcode_dialect.h"
#include "machine/gcode/gcode_motion.h"
#include "machine/link/link.h"
#include "machine/stream/status_report.h"
#include "machine/stream/stream_fault.h"
#include "machine/stream/wire.h"

namespace lensforge {

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
