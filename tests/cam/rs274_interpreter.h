// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sys/wait.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "core/temp_folder.h"

namespace lensforge::testing {

/// LinuxCNC's stand-alone interpreter: $LENSFORGE_RS274, else where fetch_rs274.sh is told to put
/// it.
inline std::optional<std::filesystem::path> rs274_interpreter() {
  std::vector<std::filesystem::path> places = {LENSFORGE_RS274_BUILD, LENSFORGE_RS274_SOURCE};
  if (const char* named = std::getenv("LENSFORGE_RS274")) places = {named};
  for (const std::filesystem::path& place : places) {
    if (std::filesystem::exists(place)) return place;
  }
  return std::nullopt;
}

/// An arc as the interpreter hands it to the machine, printed with four decimals.
struct Rs274Arc {
  int normal = 2;          ///< Number of the axis that its plane is normal to.
  Eigen::Vector2d centre;  ///< Along the two axes that follow `normal`.
  int rotation = 0;        ///< -1 clockwise.
};

/// A motion that the interpreter asks the machine for.
struct Rs274Motion {
  bool feed = false;
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  double feed_rate = 0.0;  ///< mm/min in force.
  std::optional<Rs274Arc> arc;
  int tool = 0;              ///< In the spindle.
  double tool_offset = 0.0;  ///< By which the spindle is above `to`, mm.
};

/// The interpreter's result for a program.
struct Rs274Reading {
  bool accepted = false;
  std::vector<Rs274Motion> motions;
  std::string text;    ///< Its whole canonical output.
  std::string errors;  ///< Its messages.
};

/// Follows the canonical output call by call.
class Rs274Parser {
 public:
  std::vector<Rs274Motion> run(const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) take(line);
    return motions_;
  }

 private:
  /// The numbers of a call, if the line is that call.
  static std::vector<double> numbers(const std::string& line, const std::string& call) {
    std::vector<double> all;
    const std::size_t at = line.find(" " + call + "(");
    if (at == std::string::npos) return all;
    std::string rest = line.substr(at + call.size() + 2);
    std::replace(rest.begin(), rest.end(), ',', ' ');
    std::istringstream stream(rest);
    for (double value = 0.0; stream >> value;) all.push_back(value);
    return all;
  }

  void take(const std::string& line) {
    if (line.find("CANON_PLANE_XY") != std::string::npos) normal_ = 2;
    if (line.find("CANON_PLANE_XZ") != std::string::npos) normal_ = 1;
    if (line.find("CANON_PLANE_YZ") != std::string::npos) normal_ = 0;
    if (const auto n = numbers(line, "SET_FEED_RATE"); !n.empty()) feed_rate_ = n[0];
    if (const auto n = numbers(line, "CHANGE_TOOL"); !n.empty()) tool_ = static_cast<int>(n[0]);
    if (const auto n = numbers(line, "USE_TOOL_LENGTH_OFFSET"); !n.empty()) tool_offset_ = n[2];
    if (const auto n = numbers(line, "STRAIGHT_TRAVERSE"); !n.empty()) add_straight(n, false);
    if (const auto n = numbers(line, "STRAIGHT_FEED"); !n.empty()) add_straight(n, true);
    if (const auto n = numbers(line, "ARC_FEED"); !n.empty()) add_arc(n);
  }

  void add_straight(const std::vector<double>& n, bool feed) {
    motions_.push_back({feed, {n[0], n[1], n[2]}, feed_rate_, std::nullopt, tool_, tool_offset_});
  }

  void add_arc(const std::vector<double>& n) {
    Rs274Motion motion{true,        Eigen::Vector3d::Zero(), feed_rate_, std::nullopt, tool_,
                       tool_offset_};
    motion.to[(normal_ + 1) % 3] = n[0];
    motion.to[(normal_ + 2) % 3] = n[1];
    motion.to[normal_] = n[5];
    motion.arc = Rs274Arc{normal_, {n[2], n[3]}, static_cast<int>(n[4])};
    motions_.push_back(motion);
  }

  int normal_ = 2;
  double feed_rate_ = 0.0;
  int tool_ = 0;
  double tool_offset_ = 0.0;
  std::vector<Rs274Motion> motions_;
};

/// Tools without lengths.
inline constexpr const char* kShortTools = "T1 P1 Z0 D0.4\nT2 P2 Z0 D1\nT3 P3 Z0 D3\n";

/// Runs the interpreter. Without a tool table it stops without a word, and it rewrites its variable
/// file: both are made afresh.
inline Rs274Reading read_with_rs274(const std::filesystem::path& rs274,
                                    const std::filesystem::path& program,
                                    const std::string& tools = kShortTools) {
  const TempFolder scratch;
  write_bytes(scratch / "tool.tbl", tools);
  write_bytes(scratch / "scratch.var", "");
  const std::filesystem::path out = scratch / "out.canon";
  const std::string command = "HOME='" + scratch.path().string() + "' '" + rs274.string() +
                              "' -t '" + (scratch / "tool.tbl").string() + "' -v '" +
                              (scratch / "scratch.var").string() + "' -g '" + program.string() +
                              "' '" + out.string() + "' >/dev/null 2>'" +
                              (scratch / "errors").string() + "'";
  const int status = std::system(command.c_str());
  Rs274Reading reading;
  reading.text = read_bytes(out);
  reading.errors = read_bytes(scratch / "errors");
  reading.accepted = WIFEXITED(status) && WEXITSTATUS(status) == 0 &&
                     reading.text.find("PROGRAM_END()") != std::string::npos;
  reading.motions = Rs274Parser().run(reading.text);
  return reading;
}

}  // namespace lensforge::testing
