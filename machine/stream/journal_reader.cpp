// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <fstream>

#include "machine/stream/journal.h"
#include "machine/stream/journal_text.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

void take_job(const nlohmann::json& record, const fs::path& path, JournalRecord& journal) {
  if (record.value("format", "") != journal_text::kFormat ||
      record.value("version", 0) != journal_text::kVersion) {
    refuse(path, "no journal that this version reads");
  }
  journal.job = {record.value("sha256", ""), record.value("bytes", std::int64_t{0}),
                 record.value("name", "")};
}

void take_progress(const nlohmann::json& record, JobProgress& last) {
  last.sent = std::max(last.sent, record.value("sent", std::int64_t{0}));
  last.acknowledged = std::max(last.acknowledged, record.value("ack", std::int64_t{0}));
  last.executed = std::max(last.executed, record.value("done", std::int64_t{0}));
  last.byte = std::max(last.byte, record.value("byte", std::int64_t{0}));
  last.state = record.value("state", "");
  last.spindle = record.value("spindle", "");
  last.rpm = record.value("rpm", 0.0);
  last.position.reset();
  if (record.contains("at")) {
    const auto& at = record["at"];
    last.position = Eigen::Vector3d(at[0], at[1], at[2]);
  }
}

/// What was reserved in a run that told its end was not sent beyond what it told.
struct Bounds {
  std::int64_t told = 0;
  std::int64_t reserved = 0;
};

void take(const nlohmann::json& record, JournalRecord& journal, Bounds& bounds) {
  const std::string kind = record.value("kind", "");
  if (kind == "run") {
    ++journal.runs;
    journal.status.clear();
    journal.reason.clear();
    bounds.told = std::max(bounds.told, bounds.reserved);
    bounds.reserved = 0;
  } else if (kind == "reserve") {
    bounds.reserved = std::max(bounds.reserved, record.value("sent", std::int64_t{0}));
  } else if (kind == "at" || kind == "end") {
    take_progress(record, journal.last);
    bounds.told = std::max(bounds.told, record.value("sent", std::int64_t{0}));
  }
  if (kind == "origins" && !journal.origins) {
    WorkOrigins& origins = journal.origins.emplace();
    for (std::size_t i = 0; i < origins.size(); ++i) {
      const auto& at = record["origins"].at(i);
      origins[i] = Eigen::Vector3d(at.at(0), at.at(1), at.at(2));
    }
  }
  if (kind == "end") {
    bounds.reserved = 0;
    journal.status = record.value("status", "");
    journal.reason = record.value("reason", "");
    journal.finished = journal.status == "done";
  }
}

/// Whether a whole record stands anywhere behind a bad one.
bool goes_on(std::ifstream& file) {
  for (std::string line; std::getline(file, line);) {
    if (journal_text::record_of(line)) return true;
  }
  return false;
}

}  // namespace

JournalRecord read_journal(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || fs::is_directory(path)) refuse(path, "there is no journal to resume from");
  JournalRecord journal;
  Bounds bounds;
  const auto size = static_cast<std::int64_t>(fs::file_size(path));
  for (std::string line; std::getline(file, line);) {
    // A record without its line end may be cut short by chance where it still reads well.
    const auto record = file.eof() ? std::nullopt : journal_text::record_of(line);
    if (!record) break;
    if (journal.bytes == 0) take_job(*record, path, journal);
    take(*record, journal, bounds);
    journal.bytes += static_cast<std::int64_t>(line.size()) + 1;
  }
  if (journal.bytes == 0) refuse(path, "no journal");
  if (journal.bytes < size && goes_on(file)) {
    refuse(path, "damaged at byte " + std::to_string(journal.bytes) + ", with records behind it");
  }
  journal.torn = size - journal.bytes;
  journal.last.sent = std::max({journal.last.sent, bounds.told, bounds.reserved});
  return journal;
}

}  // namespace lensforge
