// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/send.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/io/files.h"
#include "core/schema/description.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "machine/gcode/gcode_dialect.h"
#include "machine/gcode/program_seal.h"
#include "machine/guard/spindle_guard.h"
#include "machine/link/link.h"
#include "machine/link/port.h"
#include "machine/sim/simulated_machine.h"
#include "machine/stream/controller_dialogue.h"
#include "machine/stream/journal.h"
#include "machine/stream/program_facts.h"

namespace lensforge {
namespace {

/// Longest hold, about 11 days, s.
constexpr double kMaxHold = 1e6;
/// A spindle is looked at some times a second, and none takes an hour to start, s.
constexpr double kMinWait = 0.1;
constexpr double kMaxSpinUp = 3600.0;
/// The ramp is written in pieces of 0.1 mm, and the heights with five decimals, mm.
constexpr double kMinRamp = 0.1;
constexpr double kMaxRamp = 1000.0;
constexpr double kMinLift = 0.01;
constexpr double kMaxLift = 100.0;
constexpr double kMaxMargin = 100000;

void describe_controller(Description& d, SendOptions& o) {
  d.text("--port", o.port, "PORT",
         "controller: /dev/ttyUSB0[:115200], tcp:HOST:PORT, or simulated: sim:[grbl|grblhal], "
         "with @1x at real speed");
  d.word("--dialect", o.dialect, {{"grbl", "grbl"}, {"grblhal", "grblhal"}},
         "dialect that a --dry-run without --port checks");
  d.flag("--home", o.home, "home the machine first");
  d.flag("--character-counting", o.sender.character_counting,
         "keep the controller's buffer filled instead of waiting for each ok");
  d.number("--hold-limit", o.sender.hold_limit, Limits::between(0, kMaxHold), "s",
           "end the job after a hold longer than this; 0: no limit");
  d.flag("--dry-run", o.dry_run,
         "check only: the program, and with --port the controller, which runs it in its "
         "check mode ($C)");
  d.flag("--allow-changed", o.allow_changed,
         "send a program that was changed since cam wrote it: warn instead of refusing");
}

void describe_guard(Description& d, SendOptions& o) {
  d.text("--spindle", o.spindle, "MAP[@PLACE]",
         "watch the spindle over Modbus: a shipped register map or a file, and its port");
  d.word("--spindle-driver", o.owner,
         {{"host", SpindleOwner::kHost}, {"controller", SpindleOwner::kController}},
         "who commands the spindle");
  d.flag("--spindle-by-hand", o.spindle_by_hand,
         "the spindle is switched by hand, as that of a router: cuts need no M3");
  d.text("--interlocks", o.interlocks, "MAP[@PLACE]",
         "also watch a device with interlocks such as door and vacuum");
  d.number("--spindle-timeout", o.sender.spindle_timeout, Limits::between(kMinWait, kMaxSpinUp),
           "s", "maximum wait for a spindle speed");
  d.number("--spin-up", o.spin_up, Limits::between(0, kMaxSpinUp), "s",
           "time of each spindle change in the estimate");
}

void describe_journal(Description& d, SendOptions& o) {
  d.text("--journal", o.journal, "FILE", "journal file; default FILE.ngc.journal");
  d.flag("--resume", o.resume,
         "continue after a fault, with homing and a safe re-entry into the cut");
  d.flag("--restart", o.restart, "start from the beginning, although a journal is unfinished");
  d.whole("--margin", o.entry.margin, Limits::between(1, kMaxMargin),
          "minimum number of lines, before the last one carried out, that are cut again");
  d.length("--ramp", o.entry.ramp, Limits::between(kMinRamp, kMaxRamp),
           "length of the path over which the tool descends when resuming");
  d.length("--lift", o.entry.lift, Limits::between(kMinLift, kMaxLift),
           "height at which the descent begins");
}

RegisterMap map_of(const std::string& text) {
  const std::size_t at = text.find('@');
  RegisterMap map = read_register_map(find_register_map(text.substr(0, at)));
  if (at != std::string::npos) set_endpoint(map, text.substr(at + 1));
  return map;
}

}  // namespace

void describe(Description& d, SendOptions& o) {
  describe_controller(d, o);
  describe_guard(d, o);
  describe_journal(d, o);
}

void validate(const SendOptions& options) {
  require_limits(options);
  if (options.port.empty() && !options.dry_run) {
    throw InputError(
        "--port: is missing; name the controller, e.g. /dev/ttyUSB0 (only --dry-run works "
        "without)");
  }
  if (options.resume && options.restart) {
    throw InputError("--resume and --restart exclude each other");
  }
  if (options.resume && options.dry_run) {
    throw InputError("--resume and --dry-run exclude each other");
  }
  if (options.spindle_by_hand && !options.spindle.empty()) {
    throw InputError("--spindle-by-hand and --spindle exclude each other");
  }
  if (options.spindle.empty() && !options.interlocks.empty()) {
    throw InputError("--interlocks " + options.interlocks + ": needs --spindle as well");
  }
  if (options.port.starts_with("sim:") && !options.spindle.empty()) {
    throw InputError("--spindle " + options.spindle +
                     ": the simulated controller has its own clock and no Modbus; leave it out");
  }
}

std::vector<RegisterMap> register_maps(const SendOptions& options) {
  std::vector<RegisterMap> maps;
  if (!options.spindle.empty()) maps.push_back(map_of(options.spindle));
  if (!options.interlocks.empty()) maps.push_back(map_of(options.interlocks));
  if (!maps.empty()) (void)only_spindle(maps, options.owner);
  return maps;
}

namespace {

namespace fs = std::filesystem;

/// A controller and the time that it lives in.
struct MachinePort {
  PortSpec spec;
  std::unique_ptr<SimulatedMachine> machine;
  std::unique_ptr<SteadyClock> steady;  ///< Of a real one.
  std::unique_ptr<Link> link;

  [[nodiscard]] Clock& clock() const {
    return machine ? static_cast<Clock&>(*machine) : static_cast<Clock&>(*steady);
  }
};

/// Position of the part in the simulated mill of 400 x 300 x 100 mm.
const Eigen::Vector3d kSimulatedOrigin(-350.0, -250.0, -60.0);

/// Most simulated seconds per second.
constexpr double kTopPace = 1000.0;

/// Reads "", "grbl", "grblhal@1x", "@20x". @throw InputError naming --port, value and rule.
std::unique_ptr<SimulatedMachine> simulated_machine(const std::string& text) {
  const std::size_t at = text.find('@');
  WireOptions wire;
  if (at != std::string::npos) {
    const std::string pace = text.substr(at + 1);
    const bool times = pace.ends_with('x');
    if (times) {
      wire.pace = parse_numbers(pace.substr(0, pace.size() - 1), "--port sim:" + text, 1).front();
    }
    if (!(wire.pace > 0.0 && wire.pace <= kTopPace)) {
      throw InputError("--port sim:" + printable_line(text) +
                       ": the speed must be above 0x, at most 1000x; sim:grbl@1x works");
    }
  }
  const std::string name = text.substr(0, at);
  const bool grbl = parse_dialect(name.empty() ? "grbl" : name, "--port sim:").name == "grbl";
  return std::make_unique<SimulatedMachine>(grbl ? simulated_grbl() : simulated_grblhal(), wire);
}

/// Opens a serial port, a TCP connection or a simulated mill.
/// @throw InputError for a port that there is not, LinkLost, Interrupted.
MachinePort open_machine_port(const std::string& text, const std::stop_token& stop) {
  MachinePort port;
  port.spec = parse_port_spec(text);
  switch (port.spec.kind) {
    case PortSpec::Kind::kSimulated:
      port.machine = simulated_machine(port.spec.place);
      for (int i = 0; i < 6; ++i) port.machine->controller().set_origin(i, kSimulatedOrigin);
      port.link = port.machine->open();
      return port;
    case PortSpec::Kind::kSerial:
      port.link = std::make_unique<SerialLink>(port.spec);
      break;
    case PortSpec::Kind::kTcp:
      port.link = std::make_unique<TcpLink>(port.spec, stop);
      break;
  }
  port.steady = std::make_unique<SteadyClock>();
  return port;
}

constexpr int kMaxLinks = 40;  ///< The system's limit for links.

enum class Use { kRead, kWritten, kMachine };

/// Something that a job reads, writes or talks to.
struct Place {
  std::string name;  ///< For messages.
  Use use = Use::kRead;
  fs::path path;                    ///< Links followed; empty for a descriptor.
  std::optional<struct stat> file;  ///< Nothing if it does not exist yet.
};

/// Path at which a file would be created; dangling links are followed too.
fs::path resolved(fs::path path) {
  std::error_code error;
  for (int i = 0; i < kMaxLinks && fs::is_symlink(path, error); ++i) {
    path = path.parent_path() / fs::read_symlink(path, error);
  }
  const fs::path whole = fs::weakly_canonical(path, error);
  return error ? path : whole;
}

std::optional<struct stat> about(const fs::path& path) {
  struct stat found {};
  return ::stat(path.c_str(), &found) == 0 ? std::optional(found) : std::nullopt;
}

Place place(std::string name, Use use, const fs::path& path) {
  return {std::move(name), use, resolved(path), about(path)};
}

bool is_same(const Place& a, const Place& b) {
  if (!a.file || !b.file) return !a.path.empty() && a.path == b.path;
  const bool devices = S_ISCHR(a.file->st_mode) && S_ISCHR(b.file->st_mode);
  if (devices) return a.file->st_rdev == b.file->st_rdev;
  return a.file->st_dev == b.file->st_dev && a.file->st_ino == b.file->st_ino;
}

/// Two may share a device or a pipe as long as neither drives a machine.
bool disturb(const Place& a, const Place& b) {
  if (a.use == Use::kRead && b.use == Use::kRead) return false;
  if (a.use == Use::kMachine || b.use == Use::kMachine) return true;
  return !a.file || S_ISREG(a.file->st_mode);
}

void add_maps(const SendOptions& options, const std::vector<RegisterMap>& maps,
              std::vector<Place>& places) {
  const auto add = [&](const char* option, const std::string& text, const RegisterMap& map) {
    const std::string name = std::string(option) + " " + text;
    places.push_back(place(name, Use::kRead, find_register_map(text.substr(0, text.find('@')))));
    if (!map.transport.is_tcp) places.push_back(place(name, Use::kMachine, map.transport.device));
  };
  std::size_t next = 0;
  if (!options.spindle.empty()) add("--spindle", options.spindle, maps[next++]);
  if (!options.interlocks.empty()) add("--interlocks", options.interlocks, maps[next]);
}

std::vector<Place> places_of(const fs::path& program, const SendOptions& options,
                             const std::vector<RegisterMap>& maps,
                             const std::vector<NamedFile>& beside) {
  std::vector<Place> places{place(program.string(), Use::kRead, program)};
  const auto written = [&](const std::string& option, const fs::path& path) {
    places.push_back(place(option + " " + path.string(), Use::kWritten, path));
  };
  if (!options.dry_run) written("--journal", options.journal_of(program));
  for (const NamedFile& file : beside) written(file.option, file.path);
  if (!options.port.empty()) {
    const PortSpec port = parse_port_spec(options.port);
    const bool serial = port.kind == PortSpec::Kind::kSerial;
    if (serial) places.push_back(place("--port " + options.port, Use::kMachine, port.place));
  }
  add_maps(options, maps, places);
  return places;
}

/// Devices may share a bus; a controller's port is never shared.
bool on_one_bus(const Place& a, const Place& b) {
  const auto modbus = [](const Place& place) { return !place.name.starts_with("--port "); };
  return a.use == Use::kMachine && b.use == Use::kMachine && modbus(a) && modbus(b);
}

/// The very message about it must not reach the machine.
void silence(int descriptor) {
  const Descriptor nowhere(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (!nowhere.open() || ::dup2(nowhere.number(), descriptor) < 0) ::close(descriptor);
}

/// True if a descriptor of this process refers to a written file or a machine at `place`.
bool leads_to(int descriptor, const Place& place) {
  struct stat found {};
  if (place.use == Use::kRead || ::fstat(descriptor, &found) != 0) return false;
  const Place standard{{}, Use::kWritten, {}, found};
  return is_same(place, standard) && disturb(place, standard);
}

void require_free(const Place& place) {
  std::string taken;
  for (const auto& [descriptor, name] :
       {std::pair(STDOUT_FILENO, "standard output"), std::pair(STDERR_FILENO, "standard error")}) {
    if (!leads_to(descriptor, place)) continue;
    if (place.use == Use::kMachine) silence(descriptor);
    taken = name;
  }
  if (taken.empty()) return;
  throw InputError(place.name + ": is where " + taken + " goes; choose another file");
}

void require_own_address(const SendOptions& options, const std::vector<RegisterMap>& maps) {
  if (options.port.empty()) return;
  const PortSpec port = parse_port_spec(options.port);
  for (const RegisterMap& map : maps) {
    const BusTransport& bus = map.transport;
    const bool same = port.kind == PortSpec::Kind::kTcp && bus.is_tcp && port.place == bus.host &&
                      port.tcp_port == bus.port;
    if (!same) continue;
    throw InputError("--port " + options.port + ": is the address of the Modbus device " +
                     map.name + " too; each needs its own");
  }
}

/// The program, journal, other files, ports and register maps of a job must be different files and
/// devices, whatever their names, and no written one may be the target of standard output or
/// standard error. @param maps  from register_maps(). @throw InputError naming the two.
void require_apart(const fs::path& program, const SendOptions& options,
                   const std::vector<RegisterMap>& maps, const std::vector<NamedFile>& beside) {
  const std::vector<Place> places = places_of(program, options, maps, beside);
  for (const Place& place : places) require_free(place);
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const bool clash = is_same(places[i], places[k]) && disturb(places[i], places[k]);
      if (!clash || on_one_bus(places[i], places[k])) continue;
      throw InputError(places[i].name + ": is the same as " + places[k].name +
                       "; each needs a file or port of its own");
    }
  }
  require_own_address(options, maps);
}

/// Bytes of a line as cam writes them, for the pace of a serial line.
constexpr double kUsualLine = 24.0;

/// Controller settings assumed in a dry run without one: mm/min and mm/s².
constexpr double kUsualRate = 5000.0;
constexpr double kUsualAcceleration = 500.0;

/// A pass over the program that the watcher sees the progress of.
class Pass {
 public:
  Pass(JobWatcher& watcher, const std::stop_token& stop) : watcher_(watcher), stop_(stop) {}
  ~Pass() { watcher_.passed(); }
  Pass(const Pass&) = delete;
  Pass& operator=(const Pass&) = delete;

  [[nodiscard]] RunControl control() const {
    return {stop_, [&watcher = watcher_](const Progress& p) { watcher.passing(p); }};
  }

 private:
  JobWatcher& watcher_;
  const std::stop_token& stop_;
};

/// One job, step by step.
class SendJob {
 public:
  SendJob(fs::path file, const SendOptions& options, JobWatcher& watcher,
          const std::stop_token& stop, const std::stop_token& reset)
      : file_(std::move(file)),
        options_(options),
        watcher_(watcher),
        stop_(stop),
        reset_(reset),
        maps_(register_maps(options)),
        program_(open_program()) {}

  SendSummary run() {
    summary_.job = program_.identity();
    watcher_.opened(summary_.job);
    check_seal_of_program();
    require_grbl_family(*program_.open(), file_.string());
    if (options_.port.empty()) {
      examine_alone();
    } else {
      with_controller();
    }
    return std::move(summary_);
  }

 private:
  /// Before anything is made or touched.
  [[nodiscard]] ProgramFile open_program() const {
    require_apart(file_, options_, maps_, watcher_.files());
    const Pass pass(watcher_, stop_);
    return ProgramFile(file_, pass.control());
  }

  /// A program that was changed or cut short since cam wrote it is named before anything else.
  void check_seal_of_program() {
    summary_.seal_holds = check_seal(*program_.open(), RunControl(stop_, {}));
    if (summary_.seal_holds.value_or(true)) return;
    const std::string broken =
        file_.string() +
        ": its seal does not hold: it is not as cam wrote it, it was changed or cut short";
    if (!options_.allow_changed) {
      throw InputError(broken + "; make it anew, or use --allow-changed if that is meant");
    }
    watcher_.warned("warning: " + broken);
  }

  /// Against nothing but the dialect; positions are the program's own.
  void examine_alone() {
    FactsOptions facts;
    facts.dialect = parse_dialect(options_.dialect, "--dialect");
    facts.dialect.spindle_by_hand = options_.spindle_by_hand;
    facts.spin_up = options_.spin_up;
    facts.planner.max_rate.setConstant(kUsualRate);
    facts.planner.acceleration.setConstant(kUsualAcceleration);
    summary_.facts = examine(facts);
    summary_.findings.warnings = program_warnings(summary_.facts);
    watcher_.examined(summary_.facts, summary_.findings);
  }

  void with_controller() {
    if (!options_.dry_run) require_journal();
    const MachinePort port = open_machine_port(options_.port, stop_);
    Wire wire(*port.link);
    SessionOptions session;
    session.resume = options_.resume;
    session.home = options_.home || options_.resume || port.machine;
    summary_.controller = open_session(wire, port.clock(), session, stop_);
    summary_.controller->dialect.spindle_by_hand = options_.spindle_by_hand;
    watcher_.connected(*summary_.controller);
    check(wire, port);
    if (options_.dry_run) return check_mode(wire, port);
    std::unique_ptr<BackgroundGuard> guard;
    GuardOptions guard_options;
    guard_options.owner = options_.owner;
    if (!maps_.empty()) guard = guard_devices(maps_, guard_options, *port.steady);
    send(wire, port, guard.get());
  }

  [[nodiscard]] ProgramFacts examine(const FactsOptions& options) const {
    const Pass pass(watcher_, stop_);
    try {
      ProgramFacts facts = examine_program(*program_.open(), options, pass.control());
      const std::string lack = lack_of_motion(facts);
      if (!lack.empty()) throw InputError(file_.string() + ": " + lack);
      return facts;
    } catch (const GcodeError& refused) {
      const std::string why = file_.string() + ": " + refused.what();
      const std::string& wanted = options.dialect.name;
      const std::optional<StatedDialect> stated = stated_dialect(*program_.open());
      if (!stated || stated->name == wanted) throw InputError(why);
      throw OtherDialect(
          joined({why, "; line ", std::to_string(stated->line), " states the dialect ",
                  stated->name, ", the controller's is ", wanted}));
    }
  }

  /// An existing journal must not be lost and must belong to this program.
  void require_journal() {
    const fs::path path = options_.journal_of(file_);
    if (options_.resume) {
      record_ = read_journal(path);
      if (record_->job.same_program(summary_.job)) return;
      throw InputError(path.string() + ": is the journal of another program (" + record_->job.name +
                       "), not of " + file_.string());
    }
    std::error_code none;
    if (fs::status(path, none).type() == fs::file_type::not_found) return;
    require_regular_file(path);
    if (options_.restart || fs::is_empty(path) || read_journal(path).finished) return;
    throw InputError(path.string() +
                     ": an unfinished job; go on with --resume or begin again with --restart");
  }

  /// Options for examining the program for this controller and connection.
  [[nodiscard]] FactsOptions facts_of(Wire& wire, const MachinePort& port) const {
    const ControllerInfo& info = *summary_.controller;
    FactsOptions facts;
    facts.dialect = info.dialect;
    facts.start = info.start;
    facts.spin_up = options_.spin_up;
    facts.planner = planner_settings(info.settings);
    facts.planner.blocks = info.planner_blocks;
    const double round_trip =
        options_.sender.character_counting ? 0.0 : measure_round_trip(wire, port.clock(), stop_);
    const int baud = port.spec.kind == PortSpec::Kind::kSerial ? port.spec.baud : 0;
    const StreamRate rate = stream_rate(info, baud, round_trip, kUsualLine);
    facts.planner.lines_per_second = rate.lines_per_second;
    facts.planner.bytes_per_second = rate.bytes_per_second;
    return facts;
  }

  /// The program against the controller.
  void check(Wire& wire, const MachinePort& port) {
    summary_.facts = examine(facts_of(wire, port));
    summary_.findings = check_program(summary_.facts, *summary_.controller);
    check_spindle_range(summary_.facts, maps_, summary_.findings);
    watcher_.examined(summary_.facts, summary_.findings);
    if (summary_.findings.refusals.empty()) return;
    throw InputError(file_.string() + ": " + joined(summary_.findings.refusals, "; "));
  }

  void check_mode(Wire& wire, const MachinePort& port) {
    const Pass pass(watcher_, stop_);
    summary_.checked_lines = check_on_controller(wire, port.clock(), *program_.open(),
                                                 *summary_.controller, pass.control());
  }

  void send(Wire& wire, const MachinePort& port, Guard* guard) {
    const ControllerInfo& info = *summary_.controller;
    const std::unique_ptr<std::istream> program = program_.open();
    FeedOptions feed_options{info.dialect, info.line_numbers, info.start, 1, 0, {}};
    const std::unique_ptr<Journal> journal = begin_journal(feed_options);
    ProgramFeed feed(*program, feed_options);
    Sender sender({wire, port.clock(), guard, journal.get()}, info, options_.sender,
                  feed_options.first_line);
    watcher_.began(summary_, feed_options.first_offset);
    SendControl control{stop_, reset_, {}, {}};
    control.keys = [this] { return watcher_.key(); };
    control.watch = [this](const SendEvent& event) { watcher_.took(event); };
    summary_.result = sender.run(feed, control);
    watcher_.ended(*summary_.result);
  }

  [[nodiscard]] std::unique_ptr<Journal> begin_journal(FeedOptions& feed) {
    const fs::path path = options_.journal_of(file_);
    if (!record_) {
      auto journal = Journal::create(path, summary_.job, {});
      journal->origins(summary_.controller->start.tool_origins());
      return journal;
    }
    summary_.plan = plan_resume(*program_.open(), *record_, *summary_.controller, summary_.facts,
                                options_.entry);
    watcher_.confirm(*record_, *summary_.plan);
    watcher_.resumed(*summary_.plan);
    feed.first_line = summary_.plan->line;
    feed.first_offset = summary_.plan->offset;
    feed.before = summary_.plan->before;
    if (summary_.plan->line > 1) feed.start = summary_.plan->state;
    return Journal::resume(path, *record_, {});
  }

  const fs::path file_;
  const SendOptions& options_;
  JobWatcher& watcher_;
  const std::stop_token& stop_;
  const std::stop_token& reset_;
  std::vector<RegisterMap> maps_;
  ProgramFile program_;
  std::optional<JournalRecord> record_;
  SendSummary summary_;
};

}  // namespace

SendSummary send_job(const fs::path& program, const SendOptions& options, JobWatcher& watcher,
                     const std::stop_token& stop, const std::stop_token& reset) {
  validate(options);
  return SendJob(program, options, watcher, stop, reset).run();
}

}  // namespace lensforge
