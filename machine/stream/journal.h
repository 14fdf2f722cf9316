// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "core/error.h"
#include "core/io/descriptor.h"
#include "machine/stream/program_file.h"

/// How a record of the journal stands in the file: eight hexadecimal digits of its CRC-32, a blank,
/// one JSON object, a line feed.
namespace lensforge::journal_text {

inline constexpr const char* kFormat = "lensforge.journal";
inline constexpr int kVersion = 1;
inline constexpr std::size_t kLongestLine = 4096;

/// The line of a record, with its end.
std::string line_of(const nlohmann::json& record);

/// Reads a line without its end; nothing if the check sum or the form is wrong.
std::optional<nlohmann::json> record_of(std::string_view line);

/// Whether a line is the first one of a journal, of whatever version.
bool begins_journal(std::string_view line);

}  // namespace lensforge::journal_text

namespace lensforge {

/// The journal cannot be kept any more: disk full, file too large, device gone.
class JournalFailed : public RunError {
 public:
  using RunError::RunError;
};

/// How far a job has come. Lines are those of the file, counted from 1; 0 before the first.
struct JobProgress {
  std::int64_t sent = 0;          ///< Last line that was handed over, in part or whole.
  std::int64_t acknowledged = 0;  ///< Every line up to this one was taken.
  std::int64_t executed = 0;      ///< Every line up to this one was carried out, at least.
  std::int64_t byte = 0;          ///< Offset in the file behind the acknowledged line.
  std::string state;              ///< The controller's last word: "Run", "Hold" …
  std::optional<Eigen::Vector3d> position;  ///< Machine coordinates, mm.
  std::string spindle;                      ///< What is known of it, in a word.
  double rpm = 0.0;                         ///< Last reading.
};

/// Where G54 … G59 begin, machine coordinates, mm.
using WorkOrigins = std::array<Eigen::Vector3d, 6>;

/// What the sender may have done at most, and has done at least.
struct JournalRecord {
  JobIdentity job;
  bool finished = false;  ///< The program came to its end.
  std::string status;     ///< How the last run ended; empty if it just ceased.
  std::string reason;     ///< Why.
  JobProgress last;       ///< Of the last record that tells; sent, acknowledged and executed are
                          ///< the farthest of all runs, sent including what was reserved.
  std::optional<WorkOrigins> origins;  ///< When the job was begun.
  std::int64_t runs = 0;               ///< Times that the job was begun or resumed.
  std::int64_t bytes = 0;              ///< Length of the valid part of the file.
  std::int64_t torn = 0;               ///< Bytes behind it: a record cut short.
};

/// When the journal is flushed to the disk.
struct JournalOptions {
  double flush_interval = 1.0;       ///< At least this often while records come, s.
  bool flush = true;                 ///< False leaves it all to the system, for simulations.
  std::int64_t reserve_lines = 256;  ///< A reservation at least; more where lines are fast.
};

/// Append-only record of a job under way. Every record is one line of text with a check sum, so
/// that one cut short by a crash or a full disk is recognised. Records reach the file with the
/// call, and the disk by a thread that flushes several at once.
///
/// Lines are reserved before they are sent, many at a time: whatever happens, no line beyond the
/// last reservation was ever handed to the controller.
class Journal {
 public:
  /// Begins a new journal, in the place of any other journal. @throw JournalFailed; InputError if
  /// another process has it open, or the file is there and is no journal.
  static std::unique_ptr<Journal> create(const std::filesystem::path& path, const JobIdentity& job,
                                         const JournalOptions& options);
  /// Goes on with a journal, a torn record at its end cut off. @throw as create().
  static std::unique_ptr<Journal> resume(const std::filesystem::path& path,
                                         const JournalRecord& record,
                                         const JournalOptions& options);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Where the part lies, so that a later run can tell that it still does. @throw JournalFailed
  void origins(const WorkOrigins& origins);
  /// To be called before each line is sent. Reserves enough lines ahead that it seldom has to wait
  /// for the disk. @throw JournalFailed
  void before_sending(std::int64_t line) {
    if (line > asked_ - ahead_ / 2) reserve(line);
  }
  /// @throw JournalFailed
  void progress(const JobProgress& progress);
  /// A fault, a warning or a reading worth keeping, at a line. @throw JournalFailed
  void note(std::int64_t line, std::string_view text);
  /// How the run ended: "done", or another word and a reason. Reaches the disk before it returns.
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
  std::int64_t reserved_ = 0;  ///< Last line of a reservation that is on the disk.
  std::int64_t asked_ = 0;     ///< Last line of the newest reservation.
  std::int64_t ahead_ = 0;     ///< Lines that a reservation reaches ahead.
  double last_reserve_ = 0.0;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::int64_t wanted_ = 0;   ///< Size of the file that is to be on the disk.
  std::int64_t flushed_ = 0;  ///< Size of the file that is.
  int error_ = 0;             ///< Of a flush.
  bool closing_ = false;
  double last_flush_ = 0.0;
  std::thread flusher_;
};

/// Reads a journal back in constant memory.
/// @throw InputError naming the file if it is missing, no regular file, no journal, or damaged
///        elsewhere than at its end; naming the record if it holds what no sender writes.
JournalRecord read_journal(const std::filesystem::path& path);

}  // namespace lensforge
