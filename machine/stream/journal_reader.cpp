// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <fstream>
#include <system_error>

#include "core/io/files.h"
#include "machine/stream/journal.h"
#include "machine/stream/journal_text.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// More lines or bytes than any program has; leaves room for sums.
constexpr std::int64_t kMaxLines = std::int64_t{1} << 48;
/// Beyond what controllers and register maps can tell of a place, mm, or a speed, rpm.
constexpr double kLargest = 1e12;

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

/// The fields of one record. What is missing is 0 or empty; what has another type or a value that
/// no sender writes is refused.
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

/// What was reserved in a run that told its end was not sent beyond what it told.
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

/// The next line without its end, of which no more is kept than a record may have; nothing at the
/// end of the file. A record without its line end may be cut short by chance where it still reads
/// well, so that one counts as none.
std::optional<std::string> next_line(std::ifstream& file) {
  std::string line;
  for (int c = file.get(); c != std::ifstream::traits_type::eof(); c = file.get()) {
    if (c == '\n') return line;
    if (line.size() <= journal_text::kLongestLine) line += static_cast<char>(c);
  }
  return std::nullopt;
}

/// Whether a whole record stands anywhere behind a bad one.
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
