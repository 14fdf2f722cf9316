// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <csignal>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "fuzz/base_set.h"
#include "fuzz/child.h"
#include "fuzz/mutation.h"
#include "fuzz/random.h"

namespace lensforge::fuzz {

/// A run and its permitted results. Paths are relative to the sandbox; a folder's path ends with a
/// slash and includes its content.
struct Plan {
  std::string kind;
  std::vector<Command> commands;  ///< More than one run at the same time.
  double interrupt_after = 0.0;   ///< Seconds until a signal; 0: when the budget is spent.
  int signal = SIGTERM;
  bool may_fail = false;     ///< The world around the command is broken: exit code 1 is right.
  bool must_refuse = false;  ///< Nothing but exit code 2 is right.
  bool must_work = false;    ///< Nothing but exit codes 0 and 3 is right.
  std::vector<std::string> must_not_say;  ///< Findings that would be the command's own fault.
  std::vector<std::string> outputs;  ///< Where files may appear, and those of `ours` be replaced.
  std::vector<std::string> logs;     ///< Records that are kept even of a refusal.
  std::set<std::string> ours;        ///< Unchanged files that lensforge wrote.
  std::set<std::string> forced;      ///< Others' files that the command, given --force, replaces.
  std::string lens;          ///< A folder whose lens must be whole after all, old or new; or empty.
  std::string product;       ///< What `info` must accept after success; empty: nothing.
  bool serial_port = false;  ///< A simulated controller on a pseudo-terminal serves {PORT}.
  /// Hostile clients, from this seed, of the page that --live {PORT} serves.
  std::optional<std::uint64_t> page_clients;
};

/// A command line that contains each option only once.
class CommandLine {
 public:
  CommandLine(std::string command, Arguments operands)
      : command_(std::move(command)), operands_(std::move(operands)) {}

  /// Gives `option`, in place of what was given before. A flag has no value.
  CommandLine& set(const std::string& option, const std::string& value);
  CommandLine& flag(const std::string& option);
  [[nodiscard]] const std::string& command() const { return command_; }
  [[nodiscard]] Arguments words() const;

 private:
  CommandLine& put(const std::string& option, Arguments words);

  std::string command_;
  Arguments operands_;
  std::vector<std::pair<std::string, Arguments>> options_;
};

/// A sandbox in the making: files that a run finds, and its plan.
class Scene {
 public:
  Scene(const BaseSet& base_set, std::filesystem::path folder, Random& numbers)
      : base(base_set), random(numbers), folder_(std::move(folder)) {}

  const BaseSet& base;
  Random& random;
  Plan plan;

  [[nodiscard]] std::filesystem::path at(const std::string& path) const { return folder_ / path; }
  /// Somebody else's file, or an input: nothing may touch it.
  void write(const std::string& path, const std::string& bytes) const;
  /// A copy of a base file, or of all below a folder (`from` and `to` end with a slash).
  void copy(const std::string& from, const std::string& to) const;
  /// The same, as files that lensforge wrote here and may replace.
  void copy_ours(const std::string& from, const std::string& to);
  /// Things that users keep beside a lens.
  void add_users_files(const std::string& folder) const;
  /// One more command of the plan.
  Command& run(const CommandLine& line);
  /// Ends the run with SIGINT, SIGTERM or SIGHUP within `longest` seconds.
  void interrupt_within(double longest);
  /// Ends it with SIGINT, SIGTERM or SIGKILL within `longest` seconds.
  void kill_within(double longest);

  // Cheap commands that work.
  [[nodiscard]] CommandLine design(const std::string& picture, const std::string& out);
  [[nodiscard]] CommandLine cam(const std::string& lens);
  [[nodiscard]] CommandLine coupon(const std::string& out);
  [[nodiscard]] CommandLine fit(const std::string& readings, const std::string& out);
  [[nodiscard]] CommandLine export_to(const std::string& lens, const std::string& file);
  [[nodiscard]] CommandLine render(const std::string& source) const;
  [[nodiscard]] CommandLine info(const std::string& source) const;
  [[nodiscard]] CommandLine send(const std::string& program);
  [[nodiscard]] CommandLine reflect(const std::string& mesh, const std::string& out);
  [[nodiscard]] CommandLine batch(const std::string& jobs, const std::string& out);
  [[nodiscard]] CommandLine nest(const std::string& lens, const std::string& out);
  [[nodiscard]] CommandLine view(const std::string& lens, const std::string& file);

  /// Gives `count` options of the command hostile values.
  void spoil_options(CommandLine& line, std::size_t count);

 private:
  [[nodiscard]] std::string value_for(const KnownOption& option);
  [[nodiscard]] std::string some_path();

  std::filesystem::path folder_;
};

/// A kind of run.
struct Kind {
  const char* name;
  int share;  ///< Relative frequency.
  void (*make)(Scene&);
};

std::vector<Kind> design_kinds();
std::vector<Kind> lens_kinds();
std::vector<Kind> cam_kinds();
std::vector<Kind> coupon_kinds();
std::vector<Kind> mesh_kinds();
std::vector<Kind> send_kinds();
std::vector<Kind> reflect_kinds();
std::vector<Kind> batch_kinds();
std::vector<Kind> world_kinds();

}  // namespace lensforge::fuzz
