// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "core/error.h"
#include "core/io/files.h"
#include "machine/stream/program_facts.h"

/// Format of a journal record: eight hexadecimal digits of its CRC-32, a blank, one JSON object, a
/// line feed.
namespace lensforge::journal_text {

inline constexpr const char* kFormat = "lensforge.journal";
inline constexpr int kVersion = 1;
inline constexpr std::size_t kLongestLine = 4096;

/// The line of a record, with its end.
std::string line_of(const nlohmann::json& record);

/// Reads a line, given without its end; empty if its checksum or format is wrong.
std::optional<nlohmann::json> record_of(std::string_view line);

/// True if a line is the first line of a journal of any version.
bool begins_journal(std::string_view line);

}  // namespace lensforge::journal_text

namespace lensforge {

/// The journal can no longer be written: disk full, file too large, device gone.
class JournalFailed : public RunError {
 public:
  using RunError::RunError;
};

/// Options for flushing the journal to the disk.
struct JournalOptions {
  double flush_interval = 1.0;       ///< Maximum interval while records are written, s.
  bool flush = true;                 ///< False: never flush, for simulations.
  std::int64_t reserve_lines = 256;  ///< Minimum reservation; larger if lines are fast.
};

/// Append-only record of a running job. Every record is one line of text with a checksum; a record
/// truncated by a crash or a full disk is recognised. Records are written to the file at once, and
/// a thread flushes several together to the disk.
///
/// Lines are reserved before they are sent, many at a time: no line beyond the last reservation was
/// ever sent to the controller.
class Journal {
 public:
  /// Begins a new journal and replaces an existing one. @throw JournalFailed; InputError if another
  /// process has it open, or the file exists and is no journal.
  static std::unique_ptr<Journal> create(const std::filesystem::path& path, const JobIdentity& job,
                                         const JournalOptions& options);
  /// Continues a journal after removing a truncated record at its end. @throw as create().
  static std::unique_ptr<Journal> resume(const std::filesystem::path& path,
                                         const JournalRecord& record,
                                         const JournalOptions& options);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Records the part's position; a later run checks that it has not moved. @throw JournalFailed
  void origins(const WorkOrigins& origins);
  /// Call it before each line is sent. Reserves enough lines ahead to wait for the disk only
  /// rarely. @throw JournalFailed
  void before_sending(std::int64_t line) {
    if (line > asked_ - ahead_ / 2) reserve(line);
  }
  /// @throw JournalFailed
  void progress(const JobProgress& progress);
  /// Records a fault, a warning or a reading at a line. @throw JournalFailed
  void note(std::int64_t line, std::string_view text);
  /// Records the end of the run: "done", or another status and a reason. Flushed to the disk before
  /// it returns.
  /// @throw JournalFailed
  void end(std::string_view status, std::string_view reason, const JobProgress& progress);

 private:
  enum class Opening { kCreate, kResume };
  Journal(const std::filesystem::path& path, const JournalOptions& options, Opening opening);

  void reserve(std::int64_t line);
  void append(const nlohmann::json& record);
  [[noreturn]] void fail(int error) const;
  void request_flush(bool wait);
  void flush_in_turn();

  std::filesystem::path path_;
  JournalOptions options_;
  Descriptor file_;
  std::int64_t size_ = 0;
  std::int64_t reserved_ = 0;  ///< Last line of the reservations on the disk.
  std::int64_t asked_ = 0;     ///< Last line of the newest reservation.
  std::int64_t ahead_ = 0;     ///< Number of lines per reservation.
  double last_reserve_ = 0.0;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::int64_t wanted_ = 0;   ///< File size to be flushed.
  std::int64_t flushed_ = 0;  ///< File size already flushed.
  int error_ = 0;             ///< errno of a failed flush.
  bool closing_ = false;
  double last_flush_ = 0.0;
  std::thread flusher_;
};

/// Reads a journal back in constant memory.
/// @throw InputError naming the file if it is missing, no regular file, no journal, or damaged
///        before its end; naming the record if a sender cannot have written it.
JournalRecord read_journal(const std::filesystem::path& path);

}  // namespace lensforge
