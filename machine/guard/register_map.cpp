// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard/register_map.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/schema/toml.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

const char* kind_of(int function) {
  switch (function) {
    case 1:
    case 5:
    case 15:
      return "coil";
    case 2:
      return "discrete input";
    case 4:
      return "input register";
    default:
      return "holding register";
  }
}

double rpm_per_unit(const SpeedScale& scale, double rpm_per_hz) {
  return scale.in_hertz ? rpm_per_hz : 1.0;
}

}  // namespace

double rpm_of_raw(const SpeedScale& scale, double rpm_per_hz, std::uint16_t raw) {
  const double number = scale.is_signed ? static_cast<double>(static_cast<std::int16_t>(raw))
                                        : static_cast<double>(raw);
  return std::abs((number * scale.scale + scale.offset) * rpm_per_unit(scale, rpm_per_hz));
}

std::optional<std::uint16_t> raw_of_rpm(const SpeedScale& scale, double rpm_per_hz, double rpm) {
  const double value = rpm / rpm_per_unit(scale, rpm_per_hz);
  const double raw = std::round((value - scale.offset) / scale.scale);
  const double most = scale.is_signed ? 32767.0 : 65535.0;
  if (!(raw >= 0.0) || !(raw <= most)) return std::nullopt;
  return static_cast<std::uint16_t>(raw);
}

std::string address_text(const RegisterAddress& at) {
  std::array<char, 16> hex{};
  std::snprintf(hex.data(), hex.size(), " 0x%04X", static_cast<unsigned>(at.address));
  return kind_of(at.function) + std::string(hex.data());
}

namespace {

/// Common names of the drives with the old protocol.
constexpr std::array<std::string_view, 6> kHuanyangNames = {
    "huanyang", "hy", "hy_vfd", "huanyang_hy", "hy-series", "huanyang1"};

/// The folder beside the program has priority: an installed program never reads a source tree.
fs::path map_folder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = program.parent_path() / LENSFORGE_MAPS_FROM_PROGRAM;
  if (!error && fs::is_directory(installed, error)) return installed.lexically_normal();
  return LENSFORGE_MAPS_SOURCE;
}

}  // namespace

std::string huanyang_refusal() {
  return "the Huanyang HY drives do not speak Modbus: on the same wires and with the same checksum "
         "they give the function codes 1 to 6 meanings and lengths of their own (3 starts and "
         "stops "
         "the motor). Let the controller drive the spindle, or use a drive with a register map";
}

std::vector<std::string> shipped_register_maps() {
  std::vector<std::string> names;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(map_folder(), error)) {
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

fs::path find_register_map(const std::string& name) {
  const std::string lower = lower_case(name);
  if (std::find(kHuanyangNames.begin(), kHuanyangNames.end(), lower) != kHuanyangNames.end()) {
    throw InputError("register map '" + name + "': " + huanyang_refusal());
  }
  if (name.find('/') != std::string::npos || name.ends_with(".toml")) return name;
  const std::vector<std::string> names = shipped_register_maps();
  if (std::find(names.begin(), names.end(), lower) == names.end()) {
    throw InputError("register map '" + name + "': unknown register map; shipped ones are " +
                     joined(names, ", ") + ", or give a path to a .toml file");
  }
  return map_folder() / (lower + ".toml");
}

namespace {

/// Coils and registers are numbered apart, whatever function reads or writes them.
using Cell = std::pair<bool, int>;

Cell written_cell(const RegisterAddress& at) {
  return {at.function == 5 || at.function == 15, at.address};
}

/// The cell that a reading shares with writes; nothing for inputs, which cannot be written.
std::optional<Cell> read_cell(const RegisterAddress& at) {
  if (at.function != 1 && at.function != 3) return std::nullopt;
  return Cell{at.function == 1, at.address};
}

/// Result of a command: the last value of each cell.
using Outcome = std::map<Cell, std::uint16_t>;

Outcome outcome_of(const std::vector<WriteStep>& steps) {
  Outcome outcome;
  for (const WriteStep& step : steps) outcome[written_cell(step.at)] = step.value;
  return outcome;
}

bool holds_all(const Outcome& outcome, const Outcome& part) {
  return std::all_of(part.begin(), part.end(), [&](const auto& cell) {
    const auto found = outcome.find(cell.first);
    return found != outcome.end() && found->second == cell.second;
  });
}

class MapCheck {
 public:
  MapCheck(const RegisterMap& map, std::string file) : map_(map), file_(std::move(file)) {}

  void run() const {
    if (!map_.spindle) return;
    check_standstill(*map_.spindle);
    check_reading("spindle.status.speed", map_.spindle->speed.scale);
    check_fault(*map_.spindle);
    check_signals(*map_.spindle);
    if (map_.spindle->commands) check_commands(*map_.spindle->commands);
  }

 private:
  [[noreturn]] void refuse(const std::string& key, const std::string& rule) const {
    throw InputError(file_ + ": " + key + ": " + rule);
  }

  void check_standstill(const SpindleMap& spindle) const {
    const double slowest = (1.0 - spindle.tolerance) * spindle.rpm_min;
    if (spindle.stopped_rpm < slowest) return;
    refuse("spindle.stopped_rpm", number_text(spindle.stopped_rpm) +
                                      ": must be below what passes for rpm_min, " +
                                      number_text(slowest) + " (rpm_min less tolerance)");
  }

  /// The scale must resolve speeds as finely as the tolerance, and distinguish a standstill.
  void check_reading(const std::string& key, const SpeedScale& scale) const {
    const SpindleMap& spindle = *map_.spindle;
    check_resolution(key, scale);
    const auto raw = raw_of_rpm(scale, spindle.rpm_per_hz, 0.0);
    if (raw && rpm_of_raw(scale, spindle.rpm_per_hz, *raw) <= spindle.stopped_rpm) return;
    refuse(key, "with this scale and offset no reading means standing still; 0 rpm must have one");
  }

  void check_resolution(const std::string& key, const SpeedScale& scale) const {
    const SpindleMap& spindle = *map_.spindle;
    for (const double rpm : {spindle.rpm_min, spindle.rpm_max}) {
      const auto raw = raw_of_rpm(scale, spindle.rpm_per_hz, rpm);
      if (!raw) refuse(key, "rpm_min to rpm_max must fit into the register with this scale");
      const double back = rpm_of_raw(scale, spindle.rpm_per_hz, *raw);
      if (std::abs(back - rpm) <= spindle.tolerance * rpm) continue;
      refuse(key, "the register's nearest speed to " + number_text(rpm) + " rpm is " +
                      number_text(back) +
                      " rpm: farther off than tolerance; a finer scale is "
                      "needed");
    }
  }

  void check_fault(const SpindleMap& spindle) const {
    if (!spindle.fault || !spindle.fault->texts.contains(spindle.fault->clear)) return;
    refuse("spindle.status.fault.texts",
           std::to_string(spindle.fault->clear) + " means no fault (clear), and must have no text");
  }

  void check_signals(const SpindleMap& spindle) const {
    std::vector<const ReadSignal*> signals{&spindle.speed.signal};
    if (spindle.fault) signals.push_back(&spindle.fault->signal);
    if (spindle.at_speed) signals.push_back(&spindle.at_speed->signal);
    if (spindle.direction) signals.push_back(&spindle.direction->signal);
    for (std::size_t i = 0; i < signals.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) require_other_bits(*signals[i], *signals[k]);
      require_unwritten(*signals[i]);
    }
    for (const Interlock& interlock : map_.interlocks) {
      require_unwritten(interlock.flag.signal);
      for (const ReadSignal* signal : signals) require_other_bits(interlock.flag.signal, *signal);
    }
  }

  void require_other_bits(const ReadSignal& a, const ReadSignal& b) const {
    const bool same = a.at.function == b.at.function && a.at.address == b.at.address;
    if (!same || (a.mask & b.mask) == 0) return;
    refuse(a.key, address_text(a.at) + " is read as " + b.key +
                      " too; each needs an address or bits (mask) of its own");
  }

  /// A register that is written returns the requested value, not the device's state.
  void require_unwritten(const ReadSignal& signal) const {
    const std::optional<Cell> cell = read_cell(signal.at);
    if (!cell || !map_.spindle->commands) return;
    const SpindleCommands& commands = *map_.spindle->commands;
    bool written = written_cell(commands.set_speed) == *cell;
    for (const auto* steps : {&commands.run_forward, &commands.run_reverse, &commands.stop}) {
      written = written || outcome_of(*steps).contains(*cell);
    }
    if (!written) return;
    refuse(signal.key, address_text(signal.at) +
                           " is written by spindle.commands: it holds the requested value, not "
                           "what is; read the device's own");
  }

  void check_commands(const SpindleCommands& commands) const {
    check_resolution("spindle.commands.set_speed", commands.scale);
    require_different("run_forward", commands.run_forward, "stop", commands.stop);
    require_own_speed("run_forward", commands, commands.run_forward);
    if (!commands.run_reverse.empty()) {
      require_different("run_reverse", commands.run_reverse, "stop", commands.stop);
      require_different("run_reverse", commands.run_reverse, "run_forward", commands.run_forward);
      require_own_speed("run_reverse", commands, commands.run_reverse);
    }
    require_own_speed("stop", commands, commands.stop);
  }

  /// Two commands must not have the same result, nor one include the other's.
  void require_different(const std::string& name, const std::vector<WriteStep>& steps,
                         const std::string& other_name, const std::vector<WriteStep>& other) const {
    const Outcome one = outcome_of(steps);
    const Outcome two = outcome_of(other);
    if (!holds_all(one, two) && !holds_all(two, one)) return;
    refuse("spindle.commands." + name, "leaves the registers as " + other_name +
                                           " does; they must differ in a value, for example "
                                           "machine/guard/maps/generic_plc.toml");
  }

  /// Only a stop may write the speed's register: 0 rpm.
  void require_own_speed(const std::string& name, const SpindleCommands& commands,
                         const std::vector<WriteStep>& steps) const {
    for (const WriteStep& step : steps) {
      if (written_cell(step.at) != written_cell(commands.set_speed)) continue;
      const double rpm = rpm_of_raw(commands.scale, map_.spindle->rpm_per_hz, step.value);
      if (name == "stop" && rpm <= map_.spindle->stopped_rpm) continue;
      refuse("spindle.commands." + name, "writes the register of set_speed, " +
                                             address_text(step.at) +
                                             "; the speed needs a register of its own");
    }
  }

  const RegisterMap& map_;
  std::string file_;
};

/// Checks the keys of a register map in combination: the commands have different results in the
/// drive, the speed has its own register and is written and read as finely as the tolerance, no
/// register is both written and read back, and standstill is no valid speed. @param file  its name
/// in errors. @throw InputError naming file, keys and rule.
void check_register_map(const RegisterMap& map, const std::string& file) {
  MapCheck(map, file).run();
}

constexpr const char* kKind = "a register map";
constexpr double kMaxRpm = 200000.0;
/// The rates that libmodbus sets; for any other it silently sets 9600.
constexpr std::array kBauds = {1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400};

std::uint16_t word(TomlFields& fields, const std::string& key) {
  return static_cast<std::uint16_t>(fields.whole(key, {0, 65535}));
}

std::uint16_t word_or(TomlFields& fields, const std::string& key, std::uint16_t otherwise) {
  return static_cast<std::uint16_t>(fields.whole_or(key, {0, 65535}, otherwise));
}

RegisterAddress read_address(TomlFields& fields) {
  const RegisterAddress at{fields.whole("function", {0, 255}), fields.whole("address", {0, 65535})};
  if (at.function < 1 || at.function > 4) {
    fields.refuse("function",
                  "reading takes 1 (coil), 2 (discrete input), 3 (holding register) or 4 (input "
                  "register)");
  }
  return at;
}

RegisterAddress write_address(TomlFields& fields) {
  const RegisterAddress at{fields.whole("function", {0, 255}), fields.whole("address", {0, 65535})};
  if (at.function != 5 && at.function != 6 && at.function != 15 && at.function != 16) {
    fields.refuse("function", "writing takes 5 or 15 (coil), 6 or 16 (holding register)");
  }
  return at;
}

bool is_bit(const RegisterAddress& at) {
  return at.function == 1 || at.function == 2 || at.function == 5 || at.function == 15;
}

ReadSignal read_signal(TomlFields& fields) {
  ReadSignal signal;
  signal.key = fields.path();
  signal.at = read_address(fields);
  signal.mask = word_or(fields, "mask", is_bit(signal.at) ? 1 : 0xFFFF);
  if (signal.mask == 0) fields.refuse("mask", "must have at least one bit set");
  signal.interval = fields.number("interval", {0.01, 60.0});
  signal.retries = fields.whole("retries", {0, 100});
  return signal;
}

/// A value that is compared with masked readings must lie within the mask.
std::uint16_t masked_word(TomlFields& fields, const std::string& key, const ReadSignal& signal) {
  const std::uint16_t value = word(fields, key);
  if ((value & ~signal.mask) != 0) {
    fields.refuse(key, "has bits outside the mask, so that no reading can ever equal it");
  }
  return value;
}

SpeedScale read_scale(TomlFields& fields) {
  SpeedScale scale;
  scale.in_hertz = fields.one_of("quantity", {"hz", "rpm"}) == "hz";
  scale.scale = fields.number("scale", {1e-6, 1e6});
  scale.offset = fields.number_or("offset", {-1e6, 1e6}, 0.0);
  scale.is_signed = fields.flag_or("signed", false);
  return scale;
}

SpeedSignal read_speed(TomlFields fields) {
  SpeedSignal speed;
  speed.signal = read_signal(fields);
  if (is_bit(speed.signal.at)) fields.refuse("function", "a speed is no bit: 3 or 4 is needed");
  speed.scale = read_scale(fields);
  fields.finish();
  return speed;
}

FlagSignal read_flag(TomlFields& fields) {
  FlagSignal flag;
  flag.signal = read_signal(fields);
  flag.expected = masked_word(fields, "expected", flag.signal);
  return flag;
}

DirectionSignal read_direction(TomlFields fields) {
  DirectionSignal direction;
  direction.signal = read_signal(fields);
  direction.forward = masked_word(fields, "forward", direction.signal);
  direction.reverse = masked_word(fields, "reverse", direction.signal);
  if (direction.forward == direction.reverse) {
    fields.refuse("reverse", "must differ from forward");
  }
  fields.finish();
  return direction;
}

std::uint16_t fault_code(const TomlFields& texts, const std::string& key) {
  unsigned code = 0;
  const char* end = key.data() + key.size();
  const auto [stop, error] = std::from_chars(key.data(), end, code);
  if (error != std::errc{} || stop != end || code > 65535) {
    texts.refuse(key, "a fault text's key must be the code, 0 to 65535, in decimal");
  }
  return static_cast<std::uint16_t>(code);
}

FaultSignal read_fault(TomlFields fields) {
  FaultSignal fault;
  fault.signal = read_signal(fields);
  fault.clear = masked_word(fields, "clear", fault.signal);
  if (fields.has("texts")) {
    TomlFields texts = fields.table("texts");
    for (const std::string& key : texts.keys()) {
      fault.texts[fault_code(texts, key)] = texts.text(key);
    }
  }
  fields.finish();
  return fault;
}

std::vector<WriteStep> read_steps(TomlFields& commands, const std::string& key) {
  std::vector<WriteStep> steps;
  for (TomlFields& fields : commands.tables(key)) {
    WriteStep step{write_address(fields), word(fields, "value")};
    if (is_bit(step.at) && step.value > 1) fields.refuse("value", "a coil takes 0 or 1");
    fields.finish();
    steps.push_back(step);
  }
  return steps;
}

void check_speed_range(const SpindleMap& spindle, const TomlFields& fields) {
  for (const double rpm : {spindle.rpm_min, spindle.rpm_max}) {
    if (raw_of_rpm(spindle.commands->scale, spindle.rpm_per_hz, rpm)) continue;
    fields.refuse("scale", "rpm_min to rpm_max must fit into the register with this scale");
  }
}

SpindleCommands read_commands(TomlFields fields, SpindleMap& spindle) {
  SpindleCommands commands;
  TomlFields speed = fields.table("set_speed");
  commands.set_speed = write_address(speed);
  if (is_bit(commands.set_speed)) speed.refuse("function", "a speed is no bit: 6 or 16 is needed");
  commands.scale = read_scale(speed);
  speed.finish();
  spindle.commands = commands;
  check_speed_range(spindle, speed);
  commands.run_forward = read_steps(fields, "run_forward");
  if (fields.has("run_reverse")) commands.run_reverse = read_steps(fields, "run_reverse");
  commands.stop = read_steps(fields, "stop");
  commands.retries = fields.whole("retries", {0, 100});
  fields.finish();
  return commands;
}

/// A map without a fault register must state a reason, which prevents leaving it out by mistake.
void read_fault_or_reason(TomlFields& status, SpindleMap& spindle) {
  if (status.has("fault")) {
    spindle.fault = read_fault(status.table("fault"));
  } else if (status.has("no_fault_register")) {
    (void)status.text("no_fault_register");
  } else {
    status.refuse(
        "fault",
        "a spindle needs its fault register, or no_fault_register = \"why there is none\"");
  }
}

void read_status(TomlFields status, SpindleMap& spindle) {
  spindle.speed = read_speed(status.table("speed"));
  read_fault_or_reason(status, spindle);
  if (status.has("at_speed")) {
    TomlFields fields = status.table("at_speed");
    spindle.at_speed = read_flag(fields);
    fields.finish();
  }
  if (status.has("direction")) spindle.direction = read_direction(status.table("direction"));
  status.finish();
}

SpindleMap read_spindle(TomlFields fields) {
  SpindleMap spindle;
  spindle.rpm_min = fields.number("rpm_min", {1.0, kMaxRpm});
  spindle.rpm_max = fields.number("rpm_max", {1.0, kMaxRpm});
  if (spindle.rpm_max < spindle.rpm_min) fields.refuse("rpm_max", "must not be below rpm_min");
  spindle.rpm_per_hz = fields.number("rpm_per_hz", {1.0, 1000.0});
  spindle.tolerance = fields.number("tolerance", {0.001, 0.5});
  spindle.verify_reads = fields.whole("verify_reads", {2, 100});
  spindle.lost_reads = fields.whole("lost_reads", {1, 100});
  spindle.stopped_rpm = fields.number("stopped_rpm", {0.0, 1000.0});
  if (spindle.stopped_rpm >= spindle.rpm_min) {
    fields.refuse("stopped_rpm", "must be below rpm_min");
  }
  spindle.spin_up_limit = fields.number("spin_up_limit", {0.1, 600.0});
  spindle.spin_down_limit = fields.number("spin_down_limit", {0.1, 600.0});
  if (fields.has("commands")) spindle.commands = read_commands(fields.table("commands"), spindle);
  read_status(fields.table("status"), spindle);
  fields.finish();
  return spindle;
}

std::vector<Interlock> read_interlocks(TomlFields& root) {
  std::vector<Interlock> interlocks;
  for (TomlFields& fields : root.tables("interlocks")) {
    const std::string name = fields.text("name");
    for (const Interlock& other : interlocks) {
      if (other.name == name) fields.refuse("name", "is the name of an interlock above");
    }
    interlocks.push_back({name, read_flag(fields)});
    interlocks.back().flag.signal.key = name;
    fields.finish();
  }
  return interlocks;
}

void read_serial(TomlFields& fields, BusTransport& transport) {
  transport.device = fields.text("device");
  transport.baud = fields.whole("baud", {1200, 230400});
  if (std::find(kBauds.begin(), kBauds.end(), transport.baud) == kBauds.end()) {
    fields.refuse("baud",
                  "must be one of 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, "
                  "230400");
  }
  const std::string parity = fields.one_of("parity", {"none", "even", "odd"});
  transport.parity = parity == "none" ? 'N' : parity == "even" ? 'E' : 'O';
  transport.stop_bits = fields.whole("stop_bits", {1, 2});
  transport.unit = fields.whole("unit", {1, 247});
  transport.late_answer_window = fields.number("late_answer_window", {0.0, 30.0});
}

void read_network(TomlFields& fields, BusTransport& transport) {
  transport.host = fields.text("host");
  transport.port = fields.whole("port", {1, 65535});
  transport.unit = fields.whole("unit", {0, 255});
  transport.connect_timeout = fields.number("connect_timeout", {0.01, 30.0});
}

BusTransport read_transport(TomlFields fields) {
  BusTransport transport;
  transport.is_tcp = fields.one_of("kind", {"rtu", "tcp"}) == "tcp";
  if (transport.is_tcp) {
    read_network(fields, transport);
  } else {
    read_serial(fields, transport);
  }
  transport.response_timeout = fields.number("response_timeout", {0.005, 30.0});
  transport.byte_timeout = fields.number("byte_timeout", {0.0, 5.0});
  transport.request_gap = fields.number("request_gap", {0.0, 1.0});
  transport.reconnect_pause = fields.number("reconnect_pause", {0.01, 60.0});
  transport.reconnect_pause_max = fields.number("reconnect_pause_max", {0.01, 60.0});
  if (transport.reconnect_pause_max < transport.reconnect_pause) {
    fields.refuse("reconnect_pause_max", "must not be below reconnect_pause");
  }
  transport.silence_limit = fields.number("silence_limit", {0.05, 60.0});
  fields.finish();
  return transport;
}

void check_protocol(TomlFields& root) {
  (void)root.one_of("format", {"lensforge.register-map"});
  if (root.whole("version", {0, 1e6}) != 1) root.refuse("version", "this program reads version 1");
  const std::string protocol = root.text("protocol");
  if (protocol.starts_with("huanyang")) root.refuse("protocol", huanyang_refusal());
  if (protocol != "modbus") root.refuse("protocol", "must be modbus");
}

}  // namespace

RegisterMap parse_register_map(std::string_view text, const std::string& file) {
  TomlFields root(text, {file, kKind});
  check_protocol(root);
  RegisterMap map;
  map.name = root.text("name");
  map.transport = read_transport(root.table("transport"));
  if (root.has("spindle")) map.spindle = read_spindle(root.table("spindle"));
  if (root.has("interlocks")) map.interlocks = read_interlocks(root);
  if (!map.spindle && map.interlocks.empty()) {
    root.refuse("spindle", "a register map needs a spindle, or interlocks, or both");
  }
  root.finish();
  check_register_map(map, file);
  return map;
}

RegisterMap read_register_map(const fs::path& path) {
  return parse_register_map(read_toml_file(path, kKind), path.string());
}

void set_endpoint(RegisterMap& map, const std::string& endpoint) {
  const auto refuse = [&](const std::string& rule) {
    throw InputError("spindle " + map.name + ": '" + endpoint + "': " + rule);
  };
  if (endpoint.empty()) refuse("must not be empty");
  if (!map.transport.is_tcp) {
    if (!endpoint.starts_with('/')) refuse("this map needs a serial port such as /dev/ttyUSB0");
    map.transport.device = endpoint;
    return;
  }
  const auto colon = endpoint.rfind(':');
  map.transport.host = endpoint.substr(0, colon);
  if (map.transport.host.empty() || endpoint.starts_with('/')) {
    refuse("this map needs a host, or host:port");
  }
  if (colon == std::string::npos) return;
  int port = 0;
  const char* end = endpoint.data() + endpoint.size();
  const auto [stop, error] = std::from_chars(endpoint.data() + colon + 1, end, port);
  if (error != std::errc{} || stop != end || port < 1 || port > 65535) {
    refuse("the port must be 1 to 65535");
  }
  map.transport.port = port;
}

}  // namespace lensforge
