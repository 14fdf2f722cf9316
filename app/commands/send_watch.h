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

#include "app/commands/send_command.h"
#include "app/frame/option_set.h"
#include "core/io/descriptor.h"
#include "machine/stream/sender.h"

namespace lensforge::app {

/// What a view of a running job has to know beside the events.
struct JobView {
  std::int64_t bytes = 0;       ///< Of the file.
  std::int64_t lines = 0;       ///< Of the file.
  std::int64_t first_byte = 0;  ///< Where this run began.
  double estimate = 0.0;        ///< s, of the whole program.
  int planner_blocks = 0;       ///< 0 if not known.
  int rx_bytes = 0;             ///< Likewise.
};

/// "1:02:03"
std::string duration_text(double seconds);

/// How long a job still takes: what the estimate leaves, at the pace so far. Times of hold do not
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

/// Shows a running job on stderr: three lines that redraw themselves on a terminal, one line every
/// few seconds otherwise, nothing if `quiet`. The lines stay on the terminal in the end.
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
  std::size_t drawn_ = 0;  ///< Lines that stand on the terminal.
  std::string warning_;    ///< The last one.
};

/// What a TextSink is filled with, and how it is told from other people's files.
struct SinkKind {
  const char* name;                             ///< "log"
  bool (*begins)(std::string_view first_line);  ///< Whether one of this kind begins with that line.
};

/// A file, pipe or device that lines are appended to beside a running job, which it never stops: a
/// reader that does not keep up loses whole lines, and a failure ends the writing and is said once.
class TextSink {
 public:
  /// Is open() at once. Nothing is written to a file that holds anything else than what an earlier
  /// sink of this kind wrote, nor to a disk or to a serial port.
  /// @param path  "-" for standard output. @throw InputError if it cannot be.
  TextSink(const std::filesystem::path& path, const SinkKind& kind);
  TextSink() = default;

  [[nodiscard]] bool open() const { return file_.open(); }
  /// Writes a line with its end. @return why it could not and nothing is written from now on, or
  /// empty.
  std::string write(const std::string& line);
  /// Lines that were lost to a slow reader since the last call.
  long take_lost();

 private:
  std::filesystem::path path_;
  Descriptor file_;
  long lost_ = 0;
};

/// Where a trouble with a file beside the job is said.
using Warn = std::function<void(const std::string&)>;

/// What happened to a job, in words for whoever looks into it later: one line each with a time
/// stamp (UTC), appended. A log that cannot be written is a warning and stops nothing.
class JobLog {
 public:
  /// @throw InputError if a file that --log names cannot be opened.
  JobLog(const SendSettings& settings, Warn warn);

  /// Version, options, file and hash.
  void begin(const OptionSet& options, const JobIdentity& job);
  /// Who the controller is, and those of its settings that decide what it does with the program.
  void controller(const ControllerInfo& info);
  void preflight(const ProgramFacts& facts, const Findings& findings);
  void resume(const ResumePlan& plan);
  /// What an event says, and where the job stands once a minute.
  void take(const SendEvent& event);
  void end(const SendResult& result);
  void line(const std::string& text);

 private:
  Warn warn_;
  TextSink file_;
  double next_standing_ = 0.0;
};

/// A running job as JSON, one object a line that needs no other to be understood (--events). A
/// reader that does not keep up loses lines; the next one says how many. Stops nothing.
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
  nlohmann::json last_;  ///< Where the job stood at the last event.
};

}  // namespace lensforge::app
