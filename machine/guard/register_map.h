// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// Kind of failure in an exchange with a device.
enum class BusFault {
  kDown,     ///< Not connected, or the connection broke.
  kSilent,   ///< No whole answer within the response time-out.
  kRefused,  ///< The device answered with an exception.
  kGarbled,  ///< An answer that does not belong to the request: checksum, length, unit, or echo.
};

/// An exchange failed; the message gives the reason without the device's name.
class BusError : public std::runtime_error {
 public:
  BusError(BusFault fault, const std::string& what) : std::runtime_error(what), fault_(fault) {}
  [[nodiscard]] BusFault fault() const { return fault_; }

 private:
  BusFault fault_;
};

/// One register or coil and the Modbus function that accesses it.
struct RegisterAddress {
  int function = 3;  ///< 1 coil, 2 discrete input, 3 holding, 4 input register; 5, 6, 15, 16 write.
  int address = 0;   ///< As sent on the wire, counted from 0.
};

/// Access to the registers and coils of one device. One exchange per call, no retries and no
/// recovery; the device's time-outs bound every call.
class RegisterBus {
 public:
  virtual ~RegisterBus() = default;
  /// Connects. @throw BusError
  virtual void open() = 0;
  virtual void close() = 0;
  [[nodiscard]] virtual bool is_open() const = 0;
  /// Discards received bytes.
  virtual void discard() = 0;
  /// @return the register's value, or 0 or 1 of a coil. @throw BusError
  virtual std::uint16_t read(const RegisterAddress& at) = 0;
  /// Writes and checks the device's echo. @throw BusError
  virtual void write(const RegisterAddress& at, std::uint16_t value) = 0;
};

/// A register that is polled.
struct ReadSignal {
  std::string key;  ///< Key in the map, e.g. "spindle.status.speed".
  RegisterAddress at;
  std::uint16_t mask = 0xFFFF;  ///< Bits that are used; the others are cleared first.
  double interval = 0.1;        ///< s between readings.
  int retries = 3;              ///< Tolerated number of failed readings in a row.
};

/// value = raw * scale + offset, in rpm or in Hz (then rpm = value * rpm_per_hz).
struct SpeedScale {
  bool in_hertz = true;
  double scale = 1.0;
  double offset = 0.0;
  bool is_signed = false;  ///< The raw value is two's complement; its magnitude is the speed.
};

struct SpeedSignal {
  ReadSignal signal;
  SpeedScale scale;
};

/// No fault if the masked value is `clear`; otherwise a fault, named by `texts` if listed.
struct FaultSignal {
  ReadSignal signal;
  std::uint16_t clear = 0;
  std::map<std::uint16_t, std::string> texts;
};

/// True if the masked value is `expected`.
struct FlagSignal {
  ReadSignal signal;
  std::uint16_t expected = 1;
};

struct DirectionSignal {
  ReadSignal signal;
  std::uint16_t forward = 0;  ///< Masked value while turning clockwise, seen from above.
  std::uint16_t reverse = 1;
};

/// One write of a command.
struct WriteStep {
  RegisterAddress at;
  std::uint16_t value = 0;
};

/// The party that commands the spindle.
enum class SpindleOwner {
  kHost,        ///< The guard writes the commands of the register map.
  kController,  ///< The controller's M3; the guard only watches. Call spin() and stop() before the
                ///< controller executes the word.
};

/// Commands of a host-driven spindle. Each command's steps are written in order.
struct SpindleCommands {
  RegisterAddress set_speed;
  SpeedScale scale;
  std::vector<WriteStep> run_forward;
  std::vector<WriteStep> run_reverse;  ///< Empty: this spindle must not turn counter-clockwise.
  std::vector<WriteStep> stop;
  int retries = 3;  ///< Tolerated number of failed writes in a row.
};

struct SpindleMap {
  double rpm_min = 0.0;
  double rpm_max = 0.0;
  double rpm_per_hz = 60.0;       ///< 60 for a motor with one pair of poles.
  double tolerance = 0.05;        ///< Allowed deviation of a reading, share of the requested speed.
  int verify_reads = 3;           ///< Good readings in a row that verify at-speed or stopped.
  int lost_reads = 2;             ///< Bad readings in a row that count as a loss of speed.
  double stopped_rpm = 60.0;      ///< Up to this speed the spindle counts as stopped.
  double spin_up_limit = 15.0;    ///< s from the command to at-speed.
  double spin_down_limit = 30.0;  ///< s from the command to stopped.
  std::optional<SpindleCommands> commands;  ///< None: only a controller-driven spindle.
  SpeedSignal speed;
  std::optional<FaultSignal> fault;  ///< None only where the map says why.
  std::optional<FlagSignal> at_speed;
  std::optional<DirectionSignal> direction;
};

struct Interlock {
  std::string name;  ///< "door", "vacuum", "coolant", "e-stop" ...
  FlagSignal flag;
};

struct BusTransport {
  bool is_tcp = false;
  std::string device;  ///< RTU: the serial port.
  int baud = 9600;     ///< RTU.
  char parity = 'N';   ///< RTU: N, E or O.
  int stop_bits = 1;   ///< RTU.
  std::string host;    ///< TCP.
  int port = 502;      ///< TCP.
  int unit = 1;
  double response_timeout = 0.3;  ///< s from the request to the first byte of the answer.
  double byte_timeout = 0.05;     ///< s between bytes; 0: the response time-out spans them all.
  double connect_timeout = 1.0;   ///< s, TCP.
  double request_gap = 0.01;      ///< Minimum silence before a request, s.
  /// s, RTU: after a time-out the line stays idle this long and input is discarded. RTU answers
  /// have no number; a late one would be taken for the next answer.
  double late_answer_window = 0.3;
  double reconnect_pause = 0.2;      ///< s before the first new connection; doubles ...
  double reconnect_pause_max = 3.0;  ///< ... up to this.
  double silence_limit = 2.0;        ///< s without one good answer: the device is lost.
};

/// One Modbus device: its connection and the meaning of its registers.
struct RegisterMap {
  std::string name;
  BusTransport transport;
  std::optional<SpindleMap> spindle;
  std::vector<Interlock> interlocks;
};

/// @return the speed in rpm of a raw (masked) register value, never negative.
double rpm_of_raw(const SpeedScale& scale, double rpm_per_hz, std::uint16_t raw);
/// @return the raw value nearest to `rpm`; empty if it exceeds 16 bits.
std::optional<std::uint16_t> raw_of_rpm(const SpeedScale& scale, double rpm_per_hz, double rpm);
/// @return e.g. "holding register 0x200B".
std::string address_text(const RegisterAddress& at);

/// Names of the register maps that come with the program ("yl620", "h100" ...), in alphabetical
/// order; from share/lensforge/spindle beside the running program, or from the source tree of its
/// build.
std::vector<std::string> shipped_register_maps();

/// @param name  a shipped map, or a path to a file (with a slash, or ending in .toml).
/// @return the file. @throw InputError if there is no such map, or the name is that of an old
///         Huanyang drive, which does not use Modbus.
std::filesystem::path find_register_map(const std::string& name);

/// The reason for which a Huanyang HY drive cannot be used.
std::string huanyang_refusal();

/// Reads a register map (TOML, see machine/guard/maps/generic_plc.toml for every key).
/// @param file  its name in errors.
/// @throw InputError naming file, key, value and rule: not TOML, a key that is unknown, missing or
/// of the wrong type, a value out of range, or a protocol that is not Modbus.
RegisterMap parse_register_map(std::string_view text, const std::string& file);

/// parse_register_map() of a file of at most 1 MiB.
RegisterMap read_register_map(const std::filesystem::path& path);

/// Replaces the map's serial port ("/dev/ttyUSB1") or host ("10.0.0.7" or "10.0.0.7:1502"). @throw
/// InputError if `endpoint` does not fit the map's transport.
void set_endpoint(RegisterMap& map, const std::string& endpoint);

}  // namespace lensforge
