// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "app/frame/option_set.h"
#include "core/io/files.h"
#include "machine/send.h"
#include "machine/stream/sender.h"

namespace lensforge::app {

/// Options of `lensforge send`.
struct SendSettings {
  std::string file;
  std::string log;     ///< FILE.log if empty.
  std::string events;  ///< Destination of the JSON lines; none if empty.
  bool yes = false;    ///< Do not ask before resuming.
  bool keys = false;   ///< Take keys from standard input even if it is no terminal.
  SendOptions job;

  [[nodiscard]] bool has_log() const { return !job.dry_run || !log.empty(); }
  [[nodiscard]] std::filesystem::path log_path() const {
    return log.empty() ? std::filesystem::path(file + ".log") : std::filesystem::path(log);
  }
};

/// Describes every option of the command.
void describe(Description& d, SendSettings& settings);

/// "done", "interrupted" or "fault".
std::string status_word(SendStatus status);

/// Size, extent and run time of a program, one line each.
std::string facts_text(const ProgramFacts& facts);

/// Data that a view of a running job needs in addition to the events.
struct JobView {
  std::int64_t bytes = 0;                            ///< Size of the file.
  std::int64_t lines = 0;                            ///< In the file.
  std::int64_t first_byte = 0;                       ///< First byte of this run.
  double estimate = 0.0;                             ///< Run time of the whole program, s.
  int planner_blocks = 0;                            ///< 0 if not known.
  int rx_bytes = 0;                                  ///< 0 if not known.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< Of the program in the machine (G54), mm.
};

/// "1:02:03"
std::string duration_text(double seconds);

/// Remaining time of a job: the rest of the estimate, scaled by the pace so far. Holds do not
/// count.
class TimeLeft {
 public:
  explicit TimeLeft(const JobView& job) : job_(job) {}

  void take(const SendEvent& event);
  [[nodiscard]] double seconds() const { return left_; }

 private:
  JobView job_;
  double left_ = 0.0;
  double held_ = 0.0;
  double last_ = 0.0;
};

/// Shows a running job on stderr: three lines that are redrawn on a terminal, one line every few
/// seconds otherwise, nothing if `quiet`. The last lines remain on the terminal.
class OperatorView {
 public:
  OperatorView(bool quiet, const JobView& job);
  ~OperatorView();
  OperatorView(const OperatorView&) = delete;
  OperatorView& operator=(const OperatorView&) = delete;

  void take(const SendEvent& event, double left);

 private:
  using Clock = std::chrono::steady_clock;

  void note(const std::string& text);
  void show(const std::vector<std::string>& lines);
  void wipe();

  const bool quiet_;
  const bool terminal_;
  const JobView job_;
  Clock::time_point shown_ = Clock::now();
  std::size_t drawn_ = 0;  ///< Number of lines on the terminal.
  std::string warning_;    ///< Latest warning.
};

/// Kind of text in a TextSink, and how to recognise its files.
struct SinkKind {
  const char* name;                             ///< "log"
  bool (*begins)(std::string_view first_line);  ///< True if such a file begins with the line.
};

/// A file, pipe or device to which lines are appended during a job. It never stops the job: a slow
/// reader loses whole lines, and after a failure, reported once, nothing more is written.
class TextSink {
 public:
  /// Opens the sink. Refuses a file with content that no sink of this kind wrote, a disk and a
  /// serial port.
  /// @param path  "-" for standard output. @throw InputError if it cannot be opened.
  TextSink(const std::filesystem::path& path, const SinkKind& kind);
  TextSink() = default;

  [[nodiscard]] bool open() const { return file_.open(); }
  /// Writes a line with its end. @return empty, or the reason of the failure, after which nothing
  /// more is written.
  std::string write(const std::string& line);
  /// Number of lines lost to a slow reader since the last call.
  long take_lost();

 private:
  std::filesystem::path path_;
  Descriptor file_;
  long lost_ = 0;
};

/// Reports a problem with a file that accompanies the job.
using Warn = std::function<void(const std::string&)>;

/// Log of a job in words: lines with a time stamp (UTC), appended to a file. If the log cannot be
/// written, the operator is warned and the job goes on.
class JobLog {
 public:
  /// @throw InputError if a file that --log names cannot be opened.
  JobLog(const SendSettings& settings, Warn warn);

  /// Version, options, file and hash.
  void begin(const OptionSet& options, const JobIdentity& job);
  /// The controller's identity, and those of its settings that affect the program.
  void controller(const ControllerInfo& info);
  void preflight(const ProgramFacts& facts, const Findings& findings);
  void resume(const ResumePlan& plan);
  /// Logs an event, and once a minute the job's progress.
  void take(const SendEvent& event);
  void end(const SendResult& result);
  void line(const std::string& text);

 private:
  Warn warn_;
  TextSink file_;
  double next_standing_ = 0.0;
};

/// Events of a running job as JSON lines, each complete in itself (--events). A slow reader loses
/// lines; the next line states how many. Never stops the job.
class JobEvents {
 public:
  /// @throw InputError if the file that --events names cannot be opened.
  JobEvents(const SendSettings& settings, Warn warn);

  void begin(const JobIdentity& job, const JobView& view);
  /// @param left  s
  void take(const SendEvent& event, double left);
  void end(const SendResult& result);

 private:
  void write(nlohmann::json object);

  Warn warn_;
  TextSink file_;
  JobIdentity job_;
  JobView view_;
  nlohmann::json last_;  ///< The job's progress at the last event.
};

}  // namespace lensforge::app
