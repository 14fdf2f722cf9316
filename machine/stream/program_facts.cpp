// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/program_facts.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <streambuf>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"
#include "core/text/number_text.h"
#include "machine/stream/program_feed.h"
#include "machine/stream/send_steps.h"

namespace lensforge {
namespace {

constexpr std::int64_t kLinesPerReport = 1 << 14;

/// Straight down, but for what rounding makes of it, mm.
constexpr double kStraight = 1e-6;

class Examiner {
 public:
  Examiner(std::istream& in, const FactsOptions& options)
      : options_(options),
        reader_(in),
        interpreter_(options.dialect, options.start),
        model_(options.planner) {}

  ProgramFacts run(const RunControl& control) {
    while (!interpreter_.ended()) {
      const std::optional<GcodeText> text = reader_.next();
      if (!text) break;
      facts_.lines = text->line;
      take(*text);
      if (text->line % kLinesPerReport != 0) continue;
      if (control.stop_requested()) throw Interrupted();
      control.report({"reading the program", static_cast<double>(text->next_offset), 0.0,
                      "line " + std::to_string(text->line)});
    }
    facts_.ends = interpreter_.ended();
    facts_.leaves_spindle_on = spindle_order(interpreter_.state()).turning();
    facts_.time = model_.finish();
    return facts_;
  }

 private:
  void take(const GcodeText& text) {
    const GcodeBlock block = parse_gcode_block(text);
    const SpindleOrder before = spindle_order(interpreter_.state());
    const GcodeEffect effect = interpreter_.run(block);
    const std::size_t added = added_words(effect, interpreter_.state()).size();
    interpreter_.check_length(text, added);
    const std::size_t bytes = compact_gcode(text.text, false).size() + added;
    if (bytes > 0) {
      ++facts_.sent_lines;
      facts_.sent_bytes += static_cast<std::int64_t>(bytes) + 1;
      model_.line(bytes + 1);
    }
    facts_.inches = facts_.inches || interpreter_.state().inches.value_or(false);
    facts_.tool_changes += effect.tool_change ? 1 : 0;
    facts_.pauses += effect.pauses ? 1 : 0;
    if (text.unsafe_comment) facts_.unsafe_comments.add(text.line);
    if (effect.bare_circle) facts_.bare_circles.add(text.line);
    const SpindleOrder now = spindle_order(interpreter_.state());
    if (!(now == before)) take_spindle(now, text.line, effect);
    if (effect.dwell > 0.0) model_.wait(effect.dwell);
    for (const GcodeMotion& motion : effect.motions()) take_motion(motion, now);
  }

  void take_spindle(const SpindleOrder& order, std::int64_t line, const GcodeEffect& effect) {
    model_.wait(options_.spin_up);
    if (!order.turning()) return;
    const bool cuts = std::any_of(effect.motions().begin(), effect.motions().end(),
                                  [](const GcodeMotion& motion) { return !motion.rapid; });
    if (cuts) {
      throw GcodeError(line,
                       "starts or changes the spindle and cuts in one line; its speed could not "
                       "be verified in between");
    }
    facts_.least_rpm = std::min(facts_.least_rpm, order.rpm);
    if (order.rpm <= facts_.top_rpm) return;
    facts_.top_rpm = order.rpm;
    facts_.top_rpm_line = line;
  }

  void take_motion(const GcodeMotion& motion, const SpindleOrder& order) {
    ++facts_.motions;
    model_.add(motion);
    const Eigen::AlignedBox3d box = motion.bounds();
    facts_.extent.extend(box);
    if (motion.rapid) {
      facts_.rapid_z = std::max(facts_.rapid_z, motion.end.z());
      return;
    }
    if (!order.turning() && !options_.dialect.spindle_by_hand) {
      throw GcodeError(motion.line,
                       "moves at feed while the spindle is off; use --spindle-by-hand if nothing "
                       "but its switch turns it");
    }
    facts_.cut_extent.extend(box);
    take_feed(motion);
  }

  void take_feed(const GcodeMotion& motion) {
    if (motion.feed > facts_.top_feed) {
      facts_.top_feed = motion.feed;
      facts_.top_feed_line = motion.line;
    }
    const Eigen::Vector3d step = motion.end - motion.start;
    const bool down = step.z() < 0.0 && step.head<2>().norm() < kStraight && !motion.arc;
    if (down) {
      facts_.plunge_feed = std::min(facts_.plunge_feed.value_or(motion.feed), motion.feed);
    }
  }

  const FactsOptions& options_;
  GcodeReader reader_;
  GcodeInterpreter interpreter_;
  PlannerModel model_;
  ProgramFacts facts_;
};

}  // namespace

ProgramFacts examine_program(std::istream& in, const FactsOptions& options,
                             const RunControl& control) {
  return Examiner(in, options).run(control);
}

namespace {

constexpr std::int64_t kPiece = 1 << 16;
constexpr std::size_t kDigits = 64;  ///< SHA-256 of a piece.

std::string hash_of(std::string_view bytes) {
  Sha256 hash;
  hash.update(bytes);
  return hash.finish();
}

/// @return how many bytes there were, fewer than asked for at the end of the file only.
std::size_t read_at(int file, std::vector<char>& bytes, std::int64_t offset,
                    const std::filesystem::path& path) {
  std::size_t count = 0;
  while (count < bytes.size()) {
    const ssize_t got = ::pread(file, bytes.data() + count, bytes.size() - count,
                                offset + static_cast<std::int64_t>(count));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      throw RunError(path.string() + ": cannot be read: " + system_reason(errno));
    }
    if (got == 0) break;
    count += static_cast<std::size_t>(got);
  }
  return count;
}

}  // namespace

/// The open file and the hashes of its content at the first reading.
struct ProgramPieces {
  std::filesystem::path path;
  Descriptor file;
  JobIdentity job;
  std::string hashes;  ///< kDigits for each piece, one after another.

  /// Reads one piece again. @throw RunError
  void load(std::int64_t piece, std::vector<char>& bytes) const {
    const std::int64_t offset = piece * kPiece;
    bytes.resize(static_cast<std::size_t>(std::min(kPiece, job.bytes - offset)));
    const std::size_t count = read_at(file.number(), bytes, offset, path);
    const auto at = static_cast<std::size_t>(piece) * kDigits;
    if (count == bytes.size() && hashes.compare(at, kDigits, hash_of({bytes.data(), count})) == 0) {
      return;
    }
    throw RunError(path.string() +
                   ": was changed on the disk since it was checked; nothing more of it is sent");
  }
};

namespace {

/// The bytes of a ProgramFile for one reader.
class PieceBuffer : public std::streambuf {
 public:
  explicit PieceBuffer(std::shared_ptr<const ProgramPieces> pieces) : pieces_(std::move(pieces)) {}

 protected:
  int_type underflow() override {
    if (gptr() < egptr()) return traits_type::to_int_type(*gptr());
    const std::int64_t at = position();
    if (at >= pieces_->job.bytes) return traits_type::eof();
    begin_ = at - at % kPiece;
    setg(nullptr, nullptr, nullptr);
    pieces_->load(at / kPiece, bytes_);
    char* const first = bytes_.data();
    setg(first, first + (at - begin_), first + bytes_.size());
    return traits_type::to_int_type(*gptr());
  }

  pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode mode) override {
    const std::int64_t base = from == std::ios::beg   ? 0
                              : from == std::ios::cur ? position()
                                                      : pieces_->job.bytes;
    return seekpos(base + offset, mode);
  }

  pos_type seekpos(pos_type place, std::ios::openmode /*mode*/) override {
    const auto at = static_cast<std::int64_t>(static_cast<off_type>(place));
    if (at < 0 || at > pieces_->job.bytes) return pos_type(off_type(-1));
    setg(nullptr, nullptr, nullptr);
    begin_ = at;
    return place;
  }

 private:
  [[nodiscard]] std::int64_t position() const { return begin_ + (gptr() - eback()); }

  std::shared_ptr<const ProgramPieces> pieces_;
  std::vector<char> bytes_;
  std::int64_t begin_ = 0;  ///< Offset in the file of the buffer's first byte.
};

/// A stream that owns its buffer and hands on what the buffer throws.
class PieceStream : public std::istream {
 public:
  explicit PieceStream(std::shared_ptr<const ProgramPieces> pieces)
      : std::istream(nullptr), buffer_(std::move(pieces)) {
    rdbuf(&buffer_);
    exceptions(std::ios::badbit);
  }

 private:
  PieceBuffer buffer_;
};

Descriptor open_program(const std::filesystem::path& path) {
  require_regular_file(path);
  Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  struct stat about {};
  // Catches a file that took the name in between, such as a named pipe.
  if (file.open() && ::fstat(file.number(), &about) == 0 && S_ISREG(about.st_mode)) return file;
  throw InputError(path.string() + ": cannot be read: " + system_reason(errno));
}

}  // namespace

ProgramFile::ProgramFile(const std::filesystem::path& path, const RunControl& control) {
  auto pieces = std::make_shared<ProgramPieces>();
  pieces->path = path;
  pieces->file = open_program(path);
  pieces->job.name = path.filename().string();
  Sha256 whole;
  std::vector<char> bytes(kPiece);
  for (std::size_t count = bytes.size(); count == bytes.size();) {
    if (control.stop_requested()) throw Interrupted();
    count = read_at(pieces->file.number(), bytes, pieces->job.bytes, path);
    const std::string_view read(bytes.data(), count);
    if (count > 0) pieces->hashes += hash_of(read);
    whole.update(read);
    pieces->job.bytes += static_cast<std::int64_t>(count);
    control.report({"hashing the program", static_cast<double>(pieces->job.bytes), 0.0, {}});
  }
  pieces->job.sha256 = whole.finish();
  pieces_ = std::move(pieces);
}

const JobIdentity& ProgramFile::identity() const { return pieces_->job; }

std::unique_ptr<std::istream> ProgramFile::open() const {
  return std::make_unique<PieceStream>(pieces_);
}

namespace {

/// Positions are reported with three decimals, mm.
constexpr double kTravelTolerance = 0.001;

constexpr double kBitsPerByte = 10.0;

/// Bits of $22 in grblHAL and the letter of $I in Grbl that put the machine's origin at the switch.
constexpr int kOriginAtSwitch = 8;
constexpr char kForceOrigin = 'Z';

constexpr std::array kAxes = {'X', 'Y', 'Z'};

/// Up to three decimals: 12.5, 23000.
std::string number(double value) { return trimmed_decimal(value, 3); }

std::string setting_text(int number_of, double value) {
  return std::string("$").append(std::to_string(number_of)).append("=").append(number(value));
}

bool homing_on(const ControllerInfo& info) {
  return (static_cast<int>(info.setting(22).value_or(0.0)) & 1) != 0;
}

bool origin_at_switch(const ControllerInfo& info) {
  const int mask = static_cast<int>(info.setting(22).value_or(0.0));
  return info.options.find(kForceOrigin) != std::string::npos || (mask & kOriginAtSwitch) != 0;
}

/// "line 5 has", "line 5 and 2 more have"
std::string where_text(const MarkedLines& lines) {
  const std::string first = "line " + std::to_string(lines.first);
  if (lines.count == 1) return first + " has";
  return first + " and " + std::to_string(lines.count - 1) + " more have";
}

void check_spindle(const ProgramFacts& facts, const ControllerInfo& info, Findings& found) {
  const std::optional<double> most = info.setting(30);
  const std::optional<double> least = info.setting(31);
  if (most && facts.top_rpm > *most) {
    found.refusals.push_back("line " + std::to_string(facts.top_rpm_line) + " asks for S" +
                             number(facts.top_rpm) + ", but the controller turns at most " +
                             setting_text(30, *most) + " and would clamp it silently");
  }
  if (least && facts.least_rpm < *least) {
    found.refusals.push_back("the program commands S" + number(facts.least_rpm) +
                             ", but the controller turns at least " + setting_text(31, *least));
  }
  if (info.setting(32).value_or(0.0) == 1.0) {
    found.refusals.emplace_back(
        "$32=1: the controller is in laser mode, where a spindle is not waited for; set $32=0");
  }
}

void check_travel(const ProgramFacts& facts, const ControllerInfo& info, Findings& found) {
  const std::optional<Eigen::AlignedBox3d> box = travel_box(info);
  if (!box || facts.extent.isEmpty()) return;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double low = facts.extent.min()[k];
    const double high = facts.extent.max()[k];
    if (low >= box->min()[k] - kTravelTolerance && high <= box->max()[k] + kTravelTolerance) {
      continue;
    }
    const int setting = 130 + static_cast<int>(k);
    const char axis = kAxes[static_cast<std::size_t>(k)];
    found.refusals.push_back(std::string("the program moves ") + axis + " from " + number(low) +
                             " to " + number(high) + " mm in machine coordinates, the machine " +
                             "from " + number(box->min()[k]) + " to " + number(box->max()[k]) +
                             " (" + setting_text(setting, *info.setting(setting)) + ")");
  }
}

void check_state(const ControllerInfo& info, Findings& found) {
  const bool homed = info.status.homed.value_or(true);
  if (info.status.state == ReportedState::kAlarm || (homing_on(info) && !homed)) {
    found.refusals.emplace_back(
        "the machine is not homed, or in alarm: home it with --home (or $H) first");
  } else if (info.status.state != ReportedState::kIdle) {
    found.refusals.push_back("the controller is in state " +
                             std::string(state_name(info.status.state)) + "; it must be Idle");
  }
  if (homing_on(info) && !travel_box(info)) {
    found.warnings.emplace_back(
        "the controller reports no travel ($130-$132): the program's range is not checked");
  }
  if (!homing_on(info)) {
    found.warnings.emplace_back(
        "$22=0: homing is off, so travel is not checked and nothing can be resumed after a fault");
  }
}

void check_reports(const ControllerInfo& info, Findings& found) {
  if (!info.reports_room) {
    found.warnings.emplace_back("the controller does not report its buffers (Bf:, see $10)");
  }
  if (!info.line_numbers) {
    found.warnings.push_back(
        "the controller does not report line numbers (Ln:): the last line carried out is only "
        "known to " +
        std::to_string(info.planner_blocks + LineTracker::kStepLag + 1) + " motions");
  }
}

void check_feeds(const ProgramFacts& facts, const ControllerInfo& info, Findings& found) {
  double fastest = 0.0;
  for (const int setting : {110, 111, 112}) {
    fastest = std::max(fastest, info.setting(setting).value_or(0.0));
  }
  if (fastest > 0.0 && facts.top_feed > fastest) {
    found.warnings.push_back("line " + std::to_string(facts.top_feed_line) + " asks for F" +
                             number(facts.top_feed) + " mm/min, faster than any axis ($110-$112)");
  }
  if (facts.time.stream_limited()) {
    found.warnings.push_back("this path cannot be fed at this feed: around line " +
                             std::to_string(facts.time.peak_line) + " it needs " +
                             number(std::round(facts.time.peak_lines_per_second)) +
                             " lines/s and " +
                             number(std::round(facts.time.peak_bytes_per_second)) +
                             " bytes/s; the machine will stutter, and the job take " +
                             number(std::round(facts.time.stream_limited_seconds)) +
                             " s instead of " + number(std::round(facts.time.seconds)) + " s");
  }
}

}  // namespace

std::optional<Eigen::AlignedBox3d> travel_box(const ControllerInfo& info) {
  if (!homing_on(info)) return std::nullopt;
  const int inverted = static_cast<int>(info.setting(23).value_or(0.0));
  Eigen::AlignedBox3d box(Eigen::Vector3d::Zero());
  for (int k = 0; k < 3; ++k) {
    const double travel = info.setting(130 + k).value_or(0.0);
    if (travel <= 0.0) return std::nullopt;
    const bool positive = origin_at_switch(info) && (inverted >> k & 1) != 0;
    (positive ? box.max() : box.min())[k] = positive ? travel : -travel;
  }
  return box;
}

std::vector<std::string> program_warnings(const ProgramFacts& facts) {
  std::vector<std::string> warnings;
  if (facts.leaves_spindle_on) {
    warnings.emplace_back("the program ends with the spindle on: it has no M5 after its last cut");
  }
  if (!facts.ends) warnings.emplace_back("the program has no end (M2 or M30)");
  if (facts.unsafe_comments.count > 0) {
    warnings.push_back(where_text(facts.unsafe_comments) +
                       " a comment with bytes on which a controller acts, or that are no text; "
                       "comments are never sent");
  }
  if (facts.bare_circles.count > 0) {
    warnings.push_back(where_text(facts.bare_circles) +
                       " a circle without an end, which the Grbl family refuses; it is sent with "
                       "the coordinates of where the tool stands");
  }
  return warnings;
}

Findings check_program(const ProgramFacts& facts, const ControllerInfo& info) {
  Findings found;
  check_state(info, found);
  check_spindle(facts, info, found);
  check_travel(facts, info, found);
  check_feeds(facts, info, found);
  check_reports(info, found);
  for (std::string& warning : program_warnings(facts)) {
    found.warnings.push_back(std::move(warning));
  }
  if (info.dialect.spindle_by_hand) {
    found.warnings.emplace_back(
        "the spindle is switched by hand: nothing verifies that it turns before a cut");
  }
  return found;
}

void check_spindle_range(const ProgramFacts& facts, const std::vector<RegisterMap>& maps,
                         Findings& found) {
  for (const RegisterMap& map : maps) {
    if (!map.spindle || facts.top_rpm <= 0.0) continue;
    const double least = map.spindle->rpm_min;
    const double most = map.spindle->rpm_max;
    if (facts.least_rpm >= least && facts.top_rpm <= most) continue;
    const double wrong = facts.top_rpm > most ? facts.top_rpm : facts.least_rpm;
    found.refusals.push_back("the program commands S" + number(wrong) + ", but the register map " +
                             map.name + " turns at " + number(least) + " to " + number(most) +
                             " rpm");
  }
}

std::string lack_of_motion(const ProgramFacts& facts) {
  if (facts.motions > 0) return {};
  const std::string advice = "; send a program with motion, such as one that cam wrote";
  if (facts.lines == 0) return "is empty" + advice;
  const std::string lines = "its " + std::to_string(facts.lines) + " lines";
  if (facts.sent_lines == 0) return lines + " hold no command" + advice;
  return lines + (facts.ends ? " up to its end (M2, M30 or %)" : "") +
         " contain no motion: none has G0, G1, G2 or G3 with X, Y or Z" + advice;
}

StreamRate stream_rate(const ControllerInfo& info, int baud, double round_trip, double mean_bytes) {
  StreamRate rate;
  if (baud > 0) rate.bytes_per_second = baud / kBitsPerByte;
  rate.lines_per_second = info.dialect.lines_per_second;
  if (round_trip > 0.0) {
    const double transfer = baud > 0 ? mean_bytes / rate.bytes_per_second : 0.0;
    rate.lines_per_second = std::min(rate.lines_per_second, 1.0 / (round_trip + transfer));
  }
  return rate;
}

}  // namespace lensforge
