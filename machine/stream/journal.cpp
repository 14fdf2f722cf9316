// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/error.h"
#include "core/io/files.h"
#include "core/text/words.h"

namespace lensforge::journal_text {
namespace {

constexpr std::size_t kSumDigits = 8;

std::string check_sum(std::string_view text) {
  const auto* bytes = reinterpret_cast<const Bytef*>(text.data());
  const unsigned long sum = ::crc32(0, bytes, static_cast<uInt>(text.size()));
  std::array<char, kSumDigits + 1> digits{};
  std::snprintf(digits.data(), digits.size(), "%08lx", sum);
  return digits.data();
}

}  // namespace

std::string line_of(const nlohmann::json& record) {
  // A controller's output need not be UTF-8.
  const std::string text = record.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  LF_CHECK(text.size() + kSumDigits + 2 <= kLongestLine, text);
  return check_sum(text) + ' ' + text + '\n';
}

std::optional<nlohmann::json> record_of(std::string_view line) {
  if (line.size() <= kSumDigits || line[kSumDigits] != ' ') return std::nullopt;
  const std::string_view text = line.substr(kSumDigits + 1);
  if (check_sum(text) != line.substr(0, kSumDigits)) return std::nullopt;
  nlohmann::json record = nlohmann::json::parse(text, nullptr, false);
  if (!record.is_object()) return std::nullopt;
  return record;
}

bool begins_journal(std::string_view line) {
  const std::optional<nlohmann::json> record = record_of(line);
  return record && record->contains("format") && (*record)["format"] == kFormat;
}

}  // namespace lensforge::journal_text

namespace lensforge {
namespace {

namespace fs = std::filesystem;

// A reservation should last for one to four seconds.
constexpr double kShortReserve = 1.0;
constexpr double kLongReserve = 4.0;
constexpr std::int64_t kMaxAhead = 1 << 16;
/// Maximum length of a program's name in bytes, as in file systems.
constexpr std::size_t kLongestName = 255;

double seconds_now() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

/// A name is only on the disk once its folder is.
void flush_folder(const fs::path& folder) {
  const Descriptor opened(
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened.open()) ::fsync(opened.number());
}

nlohmann::json json_of(const JobProgress& at, const char* kind) {
  nlohmann::json record = {{"kind", kind},          {"sent", at.sent}, {"ack", at.acknowledged},
                           {"done", at.executed},   {"byte", at.byte}, {"state", at.state},
                           {"spindle", at.spindle}, {"rpm", at.rpm}};
  if (at.position) {
    record["at"] = {at.position->x(), at.position->y(), at.position->z()};
  }
  return record;
}

/// A file that is neither empty nor a journal is not overwritten. @throw InputError
void require_own(int descriptor, const fs::path& path) {
  struct stat about {};
  if (::fstat(descriptor, &about) != 0 || !S_ISREG(about.st_mode)) {
    throw InputError(path.string() + ": a journal has to be a file; name one with --journal");
  }
  if (about.st_size == 0) return;
  std::string text(journal_text::kLongestLine, '\0');
  const ssize_t count = ::pread(descriptor, text.data(), text.size(), 0);
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  if (journal_text::begins_journal(text.substr(0, text.find('\n')))) return;
  throw InputError(path.string() +
                   ": exists and is no journal of lensforge; name another file with --journal");
}

}  // namespace

std::unique_ptr<Journal> Journal::create(const fs::path& path, const JobIdentity& job,
                                         const JournalOptions& options) {
  std::unique_ptr<Journal> journal(new Journal(path, options, Opening::kCreate));
  journal->append({{"kind", "job"},
                   {"format", journal_text::kFormat},
                   {"version", journal_text::kVersion},
                   {"sha256", job.sha256},
                   {"bytes", job.bytes},
                   {"name", printable_line(job.name, kLongestName)}});
  journal->append({{"kind", "run"}});
  journal->request_flush(true);
  if (options.flush) flush_folder(path.parent_path());
  return journal;
}

std::unique_ptr<Journal> Journal::resume(const fs::path& path, const JournalRecord& record,
                                         const JournalOptions& options) {
  std::unique_ptr<Journal> journal(new Journal(path, options, Opening::kResume));
  if (::ftruncate(journal->file_.number(), record.bytes) != 0) journal->fail(errno);
  ::lseek(journal->file_.number(), 0, SEEK_END);
  journal->size_ = record.bytes;
  journal->append({{"kind", "run"}});
  journal->request_flush(true);
  return journal;
}

Journal::Journal(const fs::path& path, const JournalOptions& options, Opening opening)
    : path_(path), options_(options), ahead_(options.reserve_lines) {
  const int flags = O_RDWR | O_NONBLOCK | O_NOCTTY | O_CLOEXEC;
  file_ =
      Descriptor(::open(path.c_str(), flags | (opening == Opening::kCreate ? O_CREAT : 0), 0666));
  if (!file_.open()) fail(errno);
  if (::flock(file_.number(), LOCK_EX | LOCK_NB) != 0) {
    throw InputError(path.string() + ": another sender is writing this journal");
  }
  require_own(file_.number(), path);
  // Emptied only now that it is ours.
  if (opening == Opening::kCreate && ::ftruncate(file_.number(), 0) != 0) fail(errno);
  last_flush_ = seconds_now();
  if (options_.flush) flusher_ = std::thread([this] { flush_in_turn(); });
}

Journal::~Journal() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
  if (flusher_.joinable()) flusher_.join();
}

void Journal::fail(int error) const {
  throw JournalFailed(path_.string() + ": the journal cannot be kept: " + system_reason(error));
}

void Journal::origins(const WorkOrigins& origins) {
  nlohmann::json list = nlohmann::json::array();
  for (const Eigen::Vector3d& at : origins) list.push_back({at.x(), at.y(), at.z()});
  append({{"kind", "origins"}, {"origins", list}});
  request_flush(true);
}

/// The next reservation is requested when half of the last is left; the disk has that long.
/// Reservations grow with the rate of lines to about one second's worth.
void Journal::reserve(std::int64_t line) {
  if (asked_ == reserved_) {
    const double now = seconds_now();
    if (now - last_reserve_ < kShortReserve) ahead_ *= 2;
    if (now - last_reserve_ > kLongReserve) ahead_ = std::max(ahead_ / 2, options_.reserve_lines);
    ahead_ = std::min(ahead_, kMaxAhead);
    last_reserve_ = now;
    asked_ = line + ahead_;
    append({{"kind", "reserve"}, {"sent", asked_}});
    request_flush(false);
  }
  if (line > reserved_) {
    request_flush(true);
    reserved_ = asked_;
  }
}

void Journal::progress(const JobProgress& progress) {
  append(json_of(progress, "at"));
  if (seconds_now() - last_flush_ >= options_.flush_interval) request_flush(false);
}

void Journal::note(std::int64_t line, std::string_view text) {
  append({{"kind", "note"}, {"line", line}, {"text", printable_line(text)}});
  request_flush(false);
}

void Journal::end(std::string_view status, std::string_view reason, const JobProgress& progress) {
  nlohmann::json record = json_of(progress, "end");
  record["status"] = status;
  record["reason"] = printable_line(reason);
  append(record);
  request_flush(true);
}

void Journal::append(const nlohmann::json& record) {
  const std::string text = journal_text::line_of(record);
  if (!write_all(file_.number(), text)) {
    const int error = errno;
    // Otherwise complete records would later follow a truncated one.
    if (::ftruncate(file_.number(), size_) == 0) ::lseek(file_.number(), size_, SEEK_SET);
    fail(error);
  }
  size_ += static_cast<std::int64_t>(text.size());
}

void Journal::request_flush(bool wait) {
  if (!options_.flush) return;
  last_flush_ = seconds_now();
  std::unique_lock lock(mutex_);
  wanted_ = size_;
  changed_.notify_all();
  if (wait) changed_.wait(lock, [&] { return flushed_ >= wanted_ || error_ != 0; });
  if (error_ != 0) fail(error_);
}

void Journal::flush_in_turn() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return closing_ || wanted_ > flushed_; });
    if (wanted_ <= flushed_) return;
    const std::int64_t target = wanted_;
    lock.unlock();
    const int error = ::fdatasync(file_.number()) == 0 ? 0 : errno;
    lock.lock();
    // File systems that have nothing to flush say so.
    if (error != 0 && error != EINVAL && error != ENOTSUP) error_ = error;
    flushed_ = target;
    changed_.notify_all();
  }
}

namespace {

using nlohmann::json;

/// More lines or bytes than any program has; leaves room for sums.
constexpr std::int64_t kMaxLines = std::int64_t{1} << 48;
/// Exceeds any position, mm, or speed, rpm, from controllers and register maps.
constexpr double kLargest = 1e12;

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

/// The fields of one record. Missing fields are 0 or empty; a wrong type or a value that no sender
/// writes is refused.
class Fields {
 public:
  Fields(const json& record, const fs::path& path, std::int64_t number)
      : record_(record), path_(path), number_(number) {}

  [[nodiscard]] bool has(const char* key) const { return record_.contains(key); }

  [[nodiscard]] std::string text(const char* key) const {
    if (!has(key)) return {};
    if (!record_[key].is_string()) refuse_field(key, "must be a text");
    return record_[key].get<std::string>();
  }

  /// A line, or a number of bytes.
  [[nodiscard]] std::int64_t count(const char* key) const {
    if (!has(key)) return 0;
    const json& value = record_[key];
    const bool negative = value.is_number_integer() && !value.is_number_unsigned();
    if (!value.is_number_integer() || (negative && value.get<std::int64_t>() < 0) ||
        (!negative && value.get<std::uint64_t>() > static_cast<std::uint64_t>(kMaxLines))) {
      refuse_field(key, "must be an integer, 0 to " + std::to_string(kMaxLines));
    }
    return value.get<std::int64_t>();
  }

  [[nodiscard]] double rpm(const char* key) const {
    return has(key) ? number(record_[key], key) : 0.0;
  }

  [[nodiscard]] Eigen::Vector3d point(const json& value, const char* key) const {
    if (!value.is_array() || value.size() != 3) refuse_field(key, "must be three numbers");
    Eigen::Vector3d at;
    for (std::size_t k = 0; k < 3; ++k) {
      at[static_cast<Eigen::Index>(k)] = number(value[k], key);
    }
    return at;
  }

  [[nodiscard]] const json& value(const char* key) const { return record_[key]; }

  [[noreturn]] void refuse_field(const char* key, const std::string& rule) const {
    refuse(path_, "record " + std::to_string(number_) + ": '" + key + "' " + rule +
                      "; --restart begins again");
  }

 private:
  [[nodiscard]] double number(const json& value, const char* key) const {
    if (!value.is_number()) refuse_field(key, "must be a number");
    const auto number = value.get<double>();
    if (!(std::abs(number) <= kLargest)) refuse_field(key, "is beyond any machine's range");
    return number;
  }

  const json& record_;
  const fs::path& path_;
  std::int64_t number_;
};

void take_job(const Fields& record, const fs::path& path, JournalRecord& journal) {
  if (record.text("format") != journal_text::kFormat ||
      record.count("version") != journal_text::kVersion) {
    refuse(path, "no journal that this version reads");
  }
  journal.job = {record.text("sha256"), record.count("bytes"), record.text("name")};
}

void take_progress(const Fields& record, JobProgress& last) {
  last.sent = std::max(last.sent, record.count("sent"));
  last.acknowledged = std::max(last.acknowledged, record.count("ack"));
  last.executed = std::max(last.executed, record.count("done"));
  last.byte = std::max(last.byte, record.count("byte"));
  last.state = record.text("state");
  last.spindle = record.text("spindle");
  last.rpm = record.rpm("rpm");
  last.position.reset();
  if (record.has("at")) last.position = record.point(record.value("at"), "at");
}

/// A job that came farther than its program goes would be resumed behind its end.
void require_within(const Fields& record, const JournalRecord& journal) {
  const JobProgress& last = journal.last;
  if (last.byte > journal.job.bytes) record.refuse_field("byte", "is behind the program's end");
  if (last.executed > last.acknowledged || last.acknowledged > last.sent ||
      last.acknowledged > journal.job.bytes) {
    record.refuse_field("done", "is farther than what was taken, sent or in the program");
  }
}

void take_origins(const Fields& record, JournalRecord& journal) {
  const json& list = record.has("origins") ? record.value("origins") : json();
  WorkOrigins origins;
  if (!list.is_array() || list.size() != origins.size()) {
    record.refuse_field("origins", "must be six points");
  }
  for (std::size_t i = 0; i < origins.size(); ++i) origins[i] = record.point(list[i], "origins");
  if (!journal.origins) journal.origins = origins;
}

/// If a run recorded its end, the lines reserved beyond that were not sent.
struct Bounds {
  std::int64_t told = 0;
  std::int64_t reserved = 0;
};

void take(const Fields& record, JournalRecord& journal, Bounds& bounds) {
  const std::string kind = record.text("kind");
  if (kind == "run") {
    ++journal.runs;
    journal.status.clear();
    journal.reason.clear();
    bounds.told = std::max(bounds.told, bounds.reserved);
    bounds.reserved = 0;
  } else if (kind == "reserve") {
    bounds.reserved = std::max(bounds.reserved, record.count("sent"));
  } else if (kind == "at" || kind == "end") {
    take_progress(record, journal.last);
    require_within(record, journal);
    bounds.told = std::max(bounds.told, record.count("sent"));
  } else if (kind == "origins") {
    take_origins(record, journal);
  }
  if (kind == "end") {
    bounds.reserved = 0;
    journal.status = record.text("status");
    journal.reason = record.text("reason");
    journal.finished = journal.status == "done";
  }
}

/// Returns the next line without its end, truncated to a record's maximum length; empty at the end
/// of the file. A record without its line end is ignored: truncated by chance, it might still
/// parse.
std::optional<std::string> next_line(std::ifstream& file) {
  std::string line;
  for (int c = file.get(); c != std::ifstream::traits_type::eof(); c = file.get()) {
    if (c == '\n') return line;
    if (line.size() <= journal_text::kLongestLine) line += static_cast<char>(c);
  }
  return std::nullopt;
}

/// True if a valid record follows a bad one.
bool goes_on(std::ifstream& file) {
  while (const auto line = next_line(file)) {
    if (journal_text::record_of(*line)) return true;
  }
  return false;
}

}  // namespace

JournalRecord read_journal(const fs::path& path) {
  std::error_code none;
  if (fs::status(path, none).type() == fs::file_type::not_found) {
    refuse(path, "there is no journal to resume from");
  }
  std::ifstream file = open_input(path);
  JournalRecord journal;
  Bounds bounds;
  std::int64_t number = 0;
  const auto size = static_cast<std::int64_t>(fs::file_size(path));
  while (const auto line = next_line(file)) {
    const auto record = journal_text::record_of(*line);
    if (!record) break;
    const Fields fields(*record, path, ++number);
    if (journal.bytes == 0) take_job(fields, path, journal);
    take(fields, journal, bounds);
    journal.bytes += static_cast<std::int64_t>(line->size()) + 1;
  }
  if (journal.bytes == 0)
    refuse(path, "is no journal of lensforge; name another file with --journal");
  if (journal.bytes < size && goes_on(file)) {
    refuse(path, "damaged at byte " + std::to_string(journal.bytes) + ", with records behind it");
  }
  journal.torn = size - journal.bytes;
  journal.last.sent = std::max({journal.last.sent, bounds.told, bounds.reserved});
  return journal;
}

}  // namespace lensforge
