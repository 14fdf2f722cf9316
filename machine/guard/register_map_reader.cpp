// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard/register_map_reader.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "core/error.h"
#include "core/text/toml_fields.h"
#include "machine/guard/map_folder.h"
#include "machine/guard/register_map_check.h"

namespace lensforge {
namespace {

constexpr const char* kKind = "a register map";
constexpr double kMaxRpm = 200000.0;
/// The rates that libmodbus sets; for any other it takes 9600 without a word.
constexpr std::array kBauds = {1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400};

std::uint16_t word(TomlFields& fields, const std::string& key) {
  return static_cast<std::uint16_t>(fields.whole({key, 0, 65535}));
}

std::uint16_t word_or(TomlFields& fields, const std::string& key, std::uint16_t otherwise) {
  return static_cast<std::uint16_t>(fields.whole_or({key, 0, 65535}, otherwise));
}

RegisterAddress read_address(TomlFields& fields) {
  const RegisterAddress at{fields.whole({"function", 0, 255}), fields.whole({"address", 0, 65535})};
  if (at.function < 1 || at.function > 4) {
    fields.refuse("function",
                  "reading takes 1 (coil), 2 (discrete input), 3 (holding register) or 4 (input "
                  "register)");
  }
  return at;
}

RegisterAddress write_address(TomlFields& fields) {
  const RegisterAddress at{fields.whole({"function", 0, 255}), fields.whole({"address", 0, 65535})};
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
  signal.interval = fields.number({"interval", 0.01, 60.0});
  signal.retries = fields.whole({"retries", 0, 100});
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
  scale.scale = fields.number({"scale", 1e-6, 1e6});
  scale.offset = fields.number_or({"offset", -1e6, 1e6}, 0.0);
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
  commands.retries = fields.whole({"retries", 0, 100});
  fields.finish();
  return commands;
}

/// A map without a fault register has to say why, so that nobody leaves it out unawares.
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
  spindle.rpm_min = fields.number({"rpm_min", 1.0, kMaxRpm});
  spindle.rpm_max = fields.number({"rpm_max", 1.0, kMaxRpm});
  if (spindle.rpm_max < spindle.rpm_min) fields.refuse("rpm_max", "must not be below rpm_min");
  spindle.rpm_per_hz = fields.number({"rpm_per_hz", 1.0, 1000.0});
  spindle.tolerance = fields.number({"tolerance", 0.001, 0.5});
  spindle.verify_reads = fields.whole({"verify_reads", 2, 100});
  spindle.lost_reads = fields.whole({"lost_reads", 1, 100});
  spindle.stopped_rpm = fields.number({"stopped_rpm", 0.0, 1000.0});
  if (spindle.stopped_rpm >= spindle.rpm_min) {
    fields.refuse("stopped_rpm", "must be below rpm_min");
  }
  spindle.spin_up_limit = fields.number({"spin_up_limit", 0.1, 600.0});
  spindle.spin_down_limit = fields.number({"spin_down_limit", 0.1, 600.0});
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
  transport.baud = fields.whole({"baud", 1200, 230400});
  if (std::find(kBauds.begin(), kBauds.end(), transport.baud) == kBauds.end()) {
    fields.refuse("baud",
                  "must be one of 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, "
                  "230400");
  }
  const std::string parity = fields.one_of("parity", {"none", "even", "odd"});
  transport.parity = parity == "none" ? 'N' : parity == "even" ? 'E' : 'O';
  transport.stop_bits = fields.whole({"stop_bits", 1, 2});
  transport.unit = fields.whole({"unit", 1, 247});
  transport.late_answer_window = fields.number({"late_answer_window", 0.0, 30.0});
}

void read_network(TomlFields& fields, BusTransport& transport) {
  transport.host = fields.text("host");
  transport.port = fields.whole({"port", 1, 65535});
  transport.unit = fields.whole({"unit", 0, 255});
  transport.connect_timeout = fields.number({"connect_timeout", 0.01, 30.0});
}

BusTransport read_transport(TomlFields fields) {
  BusTransport transport;
  transport.is_tcp = fields.one_of("kind", {"rtu", "tcp"}) == "tcp";
  if (transport.is_tcp) {
    read_network(fields, transport);
  } else {
    read_serial(fields, transport);
  }
  transport.response_timeout = fields.number({"response_timeout", 0.005, 30.0});
  transport.byte_timeout = fields.number({"byte_timeout", 0.0, 5.0});
  transport.request_gap = fields.number({"request_gap", 0.0, 1.0});
  transport.reconnect_pause = fields.number({"reconnect_pause", 0.01, 60.0});
  transport.reconnect_pause_max = fields.number({"reconnect_pause_max", 0.01, 60.0});
  if (transport.reconnect_pause_max < transport.reconnect_pause) {
    fields.refuse("reconnect_pause_max", "must not be below reconnect_pause");
  }
  transport.silence_limit = fields.number({"silence_limit", 0.05, 60.0});
  fields.finish();
  return transport;
}

void check_protocol(TomlFields& root) {
  (void)root.one_of("format", {"lensforge.register-map"});
  if (root.whole({"version", 0, 1e6}) != 1) root.refuse("version", "this program reads version 1");
  const std::string protocol = root.text("protocol");
  if (protocol.starts_with("huanyang")) root.refuse("protocol", huanyang_refusal());
  if (protocol != "modbus") root.refuse("protocol", "must be modbus");
}

}  // namespace

RegisterMap parse_register_map(std::string_view text, const std::string& file) {
  const toml::table table = parse_toml(text, file);
  TomlFields root(table, {file, kKind});
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

RegisterMap read_register_map(const std::filesystem::path& path) {
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
