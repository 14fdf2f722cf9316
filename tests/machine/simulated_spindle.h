// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "machine/guard/register_map.h"
#include "machine/link/link.h"

namespace lensforge {

/// Faults of a simulated device.
enum class SpindleTrouble {
  kDown,       ///< The connection breaks and no new one can be made.
  kSilent,     ///< Requests are obeyed and not answered.
  kLate,       ///< Answers come `value` seconds after the request.
  kStall,      ///< The shaft is stopped, and the device reports it.
  kSag,        ///< The shaft reaches only the share `value` of the speed asked for.
  kFault,      ///< The fault register shows `value`; the spindle coasts to a stop.
  kLies,       ///< The shaft is stopped; at-speed and direction read as if it turned.
  kWrongEcho,  ///< Writes are not obeyed and echoed with another value.
  kRefuses,    ///< Every request is answered with an exception.
  kInterlock,  ///< The interlock `name` reads what it should not.
};

/// A trouble from `at` until `until`, seconds of the clock.
struct SpindleScript {
  SpindleTrouble trouble;
  double at;
  double until = 1e300;
  double value = 0.0;
  std::string name;
};

/// A spindle with its drive and interlocks, behind the registers of any map, in the time of a
/// Clock: it ramps, and has the troubles of its script. Exchanges take no time; one that is not
/// answered fails at once (BusSession counts its time-out).
///
/// Made for tests and fault campaigns: give bus() to a SpindleGuard, the script to this, and ask
/// rpm() what the shaft really does.
class SimulatedSpindle {
 public:
  /// @param ramp  rpm/s in both directions.
  SimulatedSpindle(const RegisterMap& map, Clock& clock, double ramp = 8000.0);

  /// A bus to this device, which must outlive it.
  std::unique_ptr<RegisterBus> bus();
  void add(const SpindleScript& script) { scripts_.push_back(script); }
  /// Drives the spindle as a controller's M3, M4 and M5 (0 rpm) do.
  void drive(double rpm, bool clockwise);

  /// Speed of the shaft: rpm, negative counter-clockwise.
  [[nodiscard]] double rpm();
  /// Commanded speed: rpm, 0 when stopped.
  [[nodiscard]] double asked_rpm() const { return runs_ ? asked_rpm_ : 0.0; }
  [[nodiscard]] int exchanges() const { return exchanges_; }

 private:
  class Bus;

  [[nodiscard]] const SpindleScript* active(SpindleTrouble trouble, double time) const;
  void advance();
  void move(double from, double to);
  [[nodiscard]] double next_change(double after, double before) const;
  [[nodiscard]] std::uint16_t value_at(const RegisterAddress& at);
  void put(const ReadSignal& signal, const RegisterAddress& at, std::uint16_t bits,
           std::optional<std::uint16_t>& raw) const;
  void put_spindle(const RegisterAddress& at, std::optional<std::uint16_t>& raw) const;
  void obey(const RegisterAddress& at, std::uint16_t value);
  [[nodiscard]] bool is_last_step(const std::vector<WriteStep>& steps, const RegisterAddress& at,
                                  std::uint16_t value) const;

  RegisterMap map_;
  Clock& clock_;
  double ramp_;
  std::vector<SpindleScript> scripts_;
  double speed_register_rpm_ = 0.0;
  double asked_rpm_ = 0.0;
  bool clockwise_ = true;
  bool runs_ = false;
  double rpm_ = 0.0;
  double time_;
  int exchanges_ = 0;
};

}  // namespace lensforge
