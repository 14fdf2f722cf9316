// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "app/frame/command_line.h"
#include "app/frame/console.h"
#include "app/frame/option_set.h"
#include "core/compute/executor.h"
#include "core/compute/work_estimate.h"
#include "core/io/lens_folder.h"
#include "core/text/words.h"

/// The frame of all commands, with output folder and result. File types by extension.
namespace lensforge::app {

/// True if the file has one of these extensions, in any case. @param extensions  with the dot:
/// ".ply".
inline bool has_extension(const std::filesystem::path& path,
                          std::initializer_list<const char*> extensions) {
  const std::string own = lower_case(path.extension().string());
  return std::find(extensions.begin(), extensions.end(), own) != extensions.end();
}

inline bool is_step_file(const std::filesystem::path& path) {
  return has_extension(path, {".step", ".stp"});
}

/// A command's output folder: created if missing, locked, and removed again, with the folders above
/// that were created for it, if it was created but stayed empty and nobody else uses it.
class OutputFolder {
 public:
  /// @param kind  exclusive for a command that fills the folder; shared for one that writes a
  ///        single file, which is allowed even while another command fills the folder.
  /// @throw InputError if files cannot be made in `path`; for an exclusive one also if another
  ///        command is working there.
  OutputFolder(std::filesystem::path path, FolderLock::Kind kind);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Removes partial files that a killed process left for names that are `ours`.
  /// @pre the folder is exclusive: files of a running process must not be removed.
  void remove_partial_files(const std::function<bool(const std::string& name)>& ours) const;

 private:
  std::filesystem::path path_;
  /// Folders above that did not exist, deepest first.
  std::vector<std::filesystem::path> missing_;
  MadeFolder folder_;
};

/// Result of a command.
struct CommandResult {
  nlohmann::json json = {};  ///< For --json; the frame adds "command". Null: nothing is printed.
  std::string text = {};     ///< For people.
  int exit_code = kDone;
  std::vector<std::string> warnings = {};  ///< Noted before the result, after "warning: ".
  std::vector<std::string> notes = {};     ///< Printed after the result.
};

/// Exit code of work that may have been interrupted, or have missed a stated limit.
inline int exit_code(bool done, bool limits_met = true) {
  if (!done) return kInterrupted;
  return limits_met ? kDone : kLimitMissed;
}

/// Everything that commands have in common: messages, interrupts, output folder, progress, result.
/// A command checks its input, with an estimate and the room for it, begins its work, announces the
/// estimate, computes and returns its result (run_command()).
class CommandFrame {
 public:
  explicit CommandFrame(OptionSet& options);
  /// A frame for another program, the host: it prints nothing and watches no signals. Progress goes
  /// to `host`, which asks for the end of the work, too.
  CommandFrame(OptionSet& options, RunControl host);
  ~CommandFrame();
  CommandFrame(const CommandFrame&) = delete;
  CommandFrame& operator=(const CommandFrame&) = delete;

  [[nodiscard]] OptionSet& options() const { return options_; }
  [[nodiscard]] const Console& console() const { return console_; }

  /// Begins work that keeps what it has done when it is interrupted, prints its own progress and
  /// looks after its own files; ends earlier work.
  void begin();
  /// Begins work that writes one file at its end, or none, and ends earlier work. An interrupt
  /// stops executors, too. Work that does not check for it within a second (a large system of
  /// equations, a library call) is abandoned by ending the process, unless the file is being
  /// written. @throw InputError if `out` has a folder in which files cannot be made.
  void begin_file(const std::filesystem::path& out = {});
  /// From here on the file is being written.
  void begin_writing();
  /// Begins work that fills a folder, and ends earlier work. Everything done before an interrupt is
  /// kept. @throw InputError as OutputFolder's. @return the folder.
  const OutputFolder& begin_folder(const std::filesystem::path& out);

  // Of the work that was begun.
  /// Shows progress, and stops at an interrupt. @param accepted  called once, at the first report
  /// of work done or by accept(): the library has accepted its input.
  [[nodiscard]] RunControl control(std::function<void()> accepted = {});
  void accept();
  [[nodiscard]] std::stop_token stop_token() const;
  /// Progress of work that prints its own.
  void report_to_host(const Progress& progress) const;
  [[nodiscard]] Executor executor() const { return stoppable(options_.executor()); }
  [[nodiscard]] ChosenDevice device_executor() const;

  /// Ends the work and prints its result. Returns the exit code.
  int print(CommandResult result, const std::string& command);

 private:
  struct Work;
  void start(std::unique_ptr<OutputFolder> folder, bool abandoned, bool quiet);
  [[nodiscard]] Executor stoppable(const Executor& executor) const;

  OptionSet& options_;
  const Console console_;
  const std::optional<RunControl> host_;
  std::unique_ptr<Work> work_;
};

/// A command: its name, a sentence for --help and its work. The description of its settings has its
/// options.
template <class Settings>
struct Command {
  std::string name;
  std::string description;
  CommandResult (*run)(CommandFrame& frame, Settings& settings);
  std::string example = "";  ///< For a help that lists essential options only.
};

/// Parses the arguments, runs the work in a frame and prints its result. Returns the exit code.
int run_framed(const std::string& command, OptionSet& options, const Arguments& arguments,
               const std::function<CommandResult(CommandFrame&)>& work);

template <class Settings>
int run_command(const Command<Settings>& command, const Arguments& arguments) {
  Settings settings;
  OptionSet options(command.name, command.description, command.example);
  options.fields(settings);
  return run_framed(command.name, options, arguments,
                    [&](CommandFrame& frame) { return command.run(frame, settings); });
}

/// A command for a host that is no command line, such as Python.
struct CommandCall {
  Description options;  ///< With its arguments; the values are the defaults.
  /// @throw InputError, RunError, Interrupted as the command.
  std::function<CommandResult(const OptionValues& values, const RunControl& host)> run;
};

template <class Settings>
CommandCall call_of(const Command<Settings>& command, const Settings& initial) {
  return {description_of(initial),
          [command, initial](const OptionValues& values, const RunControl& host) {
            Settings settings = initial;
            OptionSet options(command.name, command.description);
            options.fields(settings);
            options.take(values);
            CommandFrame frame(options, host);
            return command.run(frame, settings);
          }};
}

CommandCall reflect_call();
CommandCall view_call();
CommandCall plan_call();
CommandCall nest_call();
CommandCall coupon_call();
CommandCall check_call();
CommandCall info_call();
/// @param program  words that start a command of a job in a process of its own.
CommandCall batch_call(const Arguments& program);

/// Note of an interrupted command whose work can be continued.
inline constexpr const char* kContinueWithResume =
    "interrupted; run the same command with --resume to continue";

/// Prints the approximate cost of a long job at once. @param what  the subject of the sentence.
void announce_work(const WorkEstimate& needed, const Console& console,
                   const std::string& what = "this takes");

}  // namespace lensforge::app
