// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/campaign.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <tuple>

#include "core/full_disk.h"
#include "machine/campaign_process.h"
#include "machine/campaign_program.h"
#include "machine/guard/spindle_guard.h"
#include "machine/guard_clock.h"
#include "machine/sim/simulated_machine.h"
#include "machine/sim_talk.h"
#include "machine/simulated_spindle.h"
#include "machine/spy_link.h"
#include "machine/stream/controller_dialogue.h"
#include "machine/stream/journal.h"
#include "machine/stream/program_facts.h"
#include "machine/stream/resume_plan.h"
#include "machine/stream/sender.h"

namespace lensforge::campaign {
namespace {

namespace fs = std::filesystem;

constexpr int kPrograms = 6;           ///< Different ones; seeds share them.
constexpr double kAftermath = 150.0;   ///< Virtual time between the runs, s.
constexpr double kDetection = 6.0;     ///< From a mishap at the spindle to the feed hold, s.
constexpr double kHighestEntry = 8.0;  ///< The way back in runs this far above the path, mm.
const Eigen::Vector3d kOrigin(-200.0, -150.0, -40.0);

/// Where and when a job on a machine without mishaps runs.
struct Extent {
  std::int64_t first_byte[2] = {0, 0};  ///< By direction.
  std::int64_t last_byte[2] = {0, 0};
  double begin = 0.0;
  double end = 0.0;
  std::size_t written = 0;  ///< By the sender, its handshake included.
  std::size_t spoken = 0;   ///< Of those the handshake.
  std::uintmax_t journal = 0;
};

/// A machine, its spindle, and a job on it that can be run again and again.
class Workshop {
 public:
  Workshop(const Case& what, const fs::path& folder)
      : what_(what),
        program_(random_program(what.seed % kPrograms)),
        file_(folder / "job.ngc"),
        journal_(folder / "job.journal"),
        machine_(machine_options(what), {}, watch()),
        map_(testing::shipped_map("yl620")),
        spindle_(map_, machine_) {
    std::ofstream(file_, std::ios::binary) << program_;
    for (int i = 0; i < 6; ++i) machine_.controller().set_origin(i, kOrigin);
    std::vector<GuardedDevice> devices;
    devices.push_back({map_, spindle_.bus()});
    guard_ = std::make_unique<SpindleGuard>(std::move(devices), GuardOptions{}, machine_);
  }

  /// Half of all jobs watch the spindle on the bus, and all that trouble it.
  [[nodiscard]] bool guarded() const {
    if (what_.mishap == Mishap::kKilled) return false;
    const bool needed = what_.mishap == Mishap::kBusSilent || what_.mishap == Mishap::kSpindleStall;
    return needed || (what_.seed / kPrograms) % 2 == 0;
  }

  SendResult run(bool resume) {
    std::unique_ptr<Link> link = open();
    return run_on(*link, machine_, resume);
  }

  SendResult run_on(Link& link, Clock& clock, bool resume) {
    testing::SpyLink spy(link);
    Wire wire(spy);
    SessionOptions session;
    session.resume = resume;
    session.home = true;
    const ControllerInfo info = open_session(wire, clock, session, {});
    extent.spoken = spy.written;
    note_begin();
    if (!path_) path_.emplace(program_, info.start);
    std::ifstream stream(file_, std::ios::binary);
    FeedOptions feed_options{info.dialect, info.line_numbers, info.start, 1, 0, {}};
    const std::unique_ptr<Journal> journal = prepare(info, resume, feed_options);
    ProgramFeed feed(stream, feed_options);
    SenderOptions options;
    options.character_counting = what_.counting;
    options.hold_limit = 20.0;
    Sender sender({wire, clock, guarded() ? guard_.get() : nullptr, journal.get()}, info, options,
                  feed_options.first_line);
    SendResult result = sender.run(feed, {});
    if (spy.line_after_hold) violations.emplace_back("a line left after the feed hold");
    extent.written = spy.written;
    note_end();
    return result;
  }

  /// What was cut against what the program asks for. @return whether a spoilt line was cut.
  bool compare() {
    bool spoilt = false;
    for (const std::string& wrong : path_->compare(pieces, kHighestEntry)) {
      const bool elsewhere = wrong.starts_with("cut where");
      const bool glued = what_.mishap == Mishap::kRxOverrun && what_.counting && elsewhere;
      spoilt = spoilt || glued;
      if (!glued) violations.push_back(wrong);
    }
    return spoilt;
  }

  FaultyMachine& machine() { return machine_; }
  SimulatedSpindle& spindle() { return spindle_; }
  [[nodiscard]] const fs::path& journal() const { return journal_; }

  std::vector<ExecutedPiece> pieces;
  std::vector<std::string> violations;
  std::optional<ResumePlan> plan;
  Extent extent;
  double trouble_at = 1e300;  ///< When the spindle gets into trouble.

 private:
  static SimulatedOptions machine_options(const Case& what) {
    SimulatedOptions options = what.hal ? simulated_grblhal() : simulated_grbl();
    options.line_numbers = what.numbered;
    return options;
  }

  MachineWatch watch() {
    MachineWatch watch;
    watch.piece = [this](const ExecutedPiece& piece) { take(piece); };
    return watch;
  }

  void take(const ExecutedPiece& piece) {
    pieces.push_back(piece);
    if (piece.rapid || piece.jog) return;
    const bool troubled = piece.end_time > trouble_at && piece.begin_time < trouble_at + kDetection;
    const bool turns = !guarded() || std::abs(spindle_.rpm()) > 0.9 * piece.rpm;
    if (piece.spindle == 0 || piece.rpm <= 0.0 || (!turns && !troubled)) {
      violations.push_back("cut without a turning spindle at " + std::to_string(piece.end_time));
    }
  }

  /// A port that is unplugged comes back after a while.
  std::unique_ptr<Link> open() {
    for (int tries = 0;; ++tries) {
      try {
        return machine_.open();
      } catch (const LinkLost&) {
        if (tries > 100) throw;
        machine_.wait(1.0);
      }
    }
  }

  std::unique_ptr<Journal> prepare(const ControllerInfo& info, bool resume, FeedOptions& feed) {
    JournalOptions options;
    options.flush = false;
    if (!resume) {
      std::unique_ptr<Journal> journal =
          Journal::create(journal_, ProgramFile(file_).identity(), options);
      journal->origins(info.start.tool_origins());
      return journal;
    }
    const JournalRecord record = read_journal(journal_);
    std::ifstream first(file_, std::ios::binary);
    FactsOptions facts;
    facts.dialect = info.dialect;
    facts.start = info.start;
    const ProgramFacts known = examine_program(first, facts, {});
    std::ifstream second(file_, std::ios::binary);
    plan = plan_resume(second, record, info, known, {});
    feed.first_line = plan->line;
    feed.first_offset = plan->offset;
    feed.before = plan->before;
    if (plan->line > 1) feed.start = plan->state;
    return Journal::resume(journal_, record, options);
  }

  void note_begin() {
    for (const WireDirection way : {WireDirection::kToController, WireDirection::kToHost}) {
      extent.first_byte[static_cast<int>(way)] = machine_.bytes(way);
    }
    extent.begin = machine_.now();
  }

  void note_end() {
    for (const WireDirection way : {WireDirection::kToController, WireDirection::kToHost}) {
      extent.last_byte[static_cast<int>(way)] = machine_.bytes(way);
    }
    extent.end = machine_.now();
    extent.journal = fs::file_size(journal_);
  }

  Case what_;
  std::string program_;
  fs::path file_;
  fs::path journal_;
  FaultyMachine machine_;
  RegisterMap map_;
  SimulatedSpindle spindle_;
  std::unique_ptr<SpindleGuard> guard_;
  std::optional<ProgramPath> path_;
};

/// How far the job of `what` goes when nothing happens; measured once for each kind of job.
const Extent& undisturbed(const Case& what, const fs::path& folder) {
  using Key = std::tuple<std::uint64_t, bool, bool, bool, bool>;
  static std::map<Key, Extent> known;  // NOLINT: a cache of what follows from its key alone
  Workshop workshop(what, folder);
  const Key key{what.seed % kPrograms, what.hal, what.counting, what.numbered, workshop.guarded()};
  const auto found = known.find(key);
  if (found != known.end()) return found->second;
  const SendResult result = workshop.run(false);
  workshop.compare();
  if (!result.done() || !workshop.violations.empty()) {
    throw std::runtime_error("the undisturbed job fails: " + result.reason +
                             (workshop.violations.empty() ? "" : workshop.violations.front()));
  }
  return known.emplace(key, workshop.extent).first->second;
}

/// The simulated controller's own fault of this name.
std::optional<FaultKind> simulated_fault(Mishap mishap) {
  switch (mishap) {
    case Mishap::kBusSilent:
    case Mishap::kSpindleStall:
    case Mishap::kKilled:
    case Mishap::kDiskFull:
      return std::nullopt;
    default:
      return static_cast<FaultKind>(mishap);
  }
}

SimulatedFault random_fault(const Case& what, FaultKind kind, const Extent& extent,
                            std::mt19937_64& engine) {
  constexpr std::array kErrors = {1, 2, 9, 20, 22, 25, 33};
  SimulatedFault fault;
  fault.kind = kind;
  const bool to_host = what.mishap == Mishap::kLostReply || what.mishap == Mishap::kGarbledReply ||
                       what.mishap == Mishap::kDuplicatedOk || what.mishap == Mishap::kStall;
  const bool either = what.mishap == Mishap::kUnplug && engine() % 2 == 0;
  fault.direction = to_host || either ? WireDirection::kToHost : WireDirection::kToController;
  const int way = static_cast<int>(fault.direction);
  const auto span = static_cast<std::uint64_t>(extent.last_byte[way] - extent.first_byte[way]);
  fault.at_byte = extent.first_byte[way] + static_cast<std::int64_t>(engine() % span);
  fault.seconds = 0.5 + static_cast<double>(engine() % 2000) / 100.0;
  if (kind == FaultKind::kError) fault.code = kErrors[engine() % kErrors.size()];
  // A full buffer loses what comes until there is room: more than a line.
  if (kind == FaultKind::kRxOverrun)
    fault.code = (what.counting ? 80 : 25) + static_cast<int>(engine() % 20);
  return fault;
}

/// The first run, with its mishap. @return how it ended; nothing if it was killed.
std::optional<SendResult> disturbed_run(const Case& what, const Extent& extent,
                                        std::mt19937_64& engine, Workshop& workshop,
                                        Outcome& outcome) {
  const double share = static_cast<double>(engine() % 10000) / 10000.0;
  if (what.mishap == Mishap::kKilled) {
    const auto bytes =
        extent.spoken +
        static_cast<std::size_t>(share * static_cast<double>(extent.written - extent.spoken));
    outcome.struck = run_and_kill(workshop.machine(), bytes, [&](Link& link, Clock& clock) {
      workshop.run_on(link, clock, false);
    });
    return std::nullopt;
  }
  if (what.mishap == Mishap::kDiskFull) {
    const auto size = 1024 + static_cast<rlim_t>(share * static_cast<double>(extent.journal));
    const testing::FullDisk full(size);
    SendResult result = workshop.run(false);
    outcome.struck = result.cause == StopCause::kJournal;
    return result;
  }
  if (const auto kind = simulated_fault(what.mishap)) {
    workshop.machine().add_fault(random_fault(what, *kind, extent, engine));
  } else {
    workshop.trouble_at = extent.begin + share * (extent.end - extent.begin);
    const auto trouble =
        what.mishap == Mishap::kBusSilent ? SpindleTrouble::kSilent : SpindleTrouble::kStall;
    workshop.spindle().add({trouble, workshop.trouble_at, workshop.trouble_at + 60.0, 0.0, {}});
  }
  SendResult result = workshop.run(false);
  outcome.struck =
      !workshop.machine().strikes().empty() || workshop.machine().now() > workshop.trouble_at;
  return result;
}

/// N words of the cuts that began between two moments.
std::set<std::int64_t> numbers_of(const std::vector<ExecutedPiece>& pieces, double from,
                                  double to) {
  std::set<std::int64_t> numbers;
  for (const ExecutedPiece& piece : pieces) {
    const bool then = piece.begin_time >= from && piece.begin_time < to;
    if (then && !piece.rapid && piece.number > 0) numbers.insert(piece.number);
  }
  return numbers;
}

void check_overlap(const Workshop& workshop, double resumed_at, Outcome& outcome) {
  const auto first = numbers_of(workshop.pieces, 0.0, resumed_at);
  const auto second = numbers_of(workshop.pieces, resumed_at, 1e300);
  std::vector<std::int64_t> twice;
  std::set_intersection(first.begin(), first.end(), second.begin(), second.end(),
                        std::back_inserter(twice));
  outcome.overlap = static_cast<std::int64_t>(twice.size());
  const ResumePlan& plan = *workshop.plan;
  if (!second.empty() && *second.begin() < plan.line) {
    outcome.violations.emplace_back("a line before the one to resume at was run");
  }
  if (!twice.empty() && twice.back() > plan.overlap_end) {
    outcome.violations.push_back("line " + std::to_string(twice.back()) +
                                 " was run twice beyond the stated overlap");
  }
}

}  // namespace

std::string mishap_name(Mishap mishap) {
  switch (mishap) {
    case Mishap::kBusSilent:
      return "bus-silent";
    case Mishap::kSpindleStall:
      return "spindle-stall";
    case Mishap::kKilled:
      return "killed";
    case Mishap::kDiskFull:
      return "disk-full";
    default:
      return fault_name(*simulated_fault(mishap));
  }
}

Outcome run_case(const Case& what, const fs::path& folder) {
  Outcome outcome;
  const Extent extent = undisturbed(what, folder);
  std::mt19937_64 engine(what.seed * 7919 + static_cast<std::uint64_t>(what.mishap));
  Workshop workshop(what, folder);
  const std::optional<SendResult> first = disturbed_run(what, extent, engine, workshop, outcome);
  const std::size_t at_end = workshop.pieces.size();
  workshop.machine().wait(kAftermath);
  const std::size_t at_resume = workshop.pieces.size();
  const double resumed_at = workshop.machine().now();
  outcome.cause = first ? first->cause : StopCause::kNone;
  outcome.finished_at_once = first && first->done();
  if (first && first->at_rest && at_resume > at_end) {
    outcome.violations.emplace_back("the machine moved after it had come to rest");
  }
  if (!outcome.finished_at_once) {
    const SendResult second = workshop.run(true);
    outcome.resumed = second.done();
    if (!second.done()) outcome.violations.push_back("no resume: " + second.reason);
    check_overlap(workshop, resumed_at, outcome);
  }
  outcome.spoilt = workshop.compare();
  outcome.violations.insert(outcome.violations.end(), workshop.violations.begin(),
                            workshop.violations.end());
  fs::remove(workshop.journal());
  fs::remove(folder / "job.ngc");
  return outcome;
}

Case case_of(std::uint64_t index) {
  Case what;
  what.mishap = static_cast<Mishap>(index % kMishaps);
  const std::uint64_t round = index / kMishaps;
  what.hal = round % 2 == 1;
  what.counting = round / 2 % 2 == 1;
  what.numbered = round / 4 % 3 != 2;
  what.seed = round * 31 + index % kMishaps;
  return what;
}

}  // namespace lensforge::campaign
