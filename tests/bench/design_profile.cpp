// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/design_profile.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <sstream>

#include "core/error.h"

namespace lensforge::bench {
namespace {

using Cells = std::vector<std::string>;

Cells cells_of(const std::string& line) {
  Cells cells;
  std::istringstream words(line);
  for (std::string cell; std::getline(words, cell, ',');) cells.push_back(cell);
  return cells;
}

std::size_t column_of(const Cells& header, const std::string& name) {
  const auto found = std::find(header.begin(), header.end(), name);
  if (found == header.end()) throw InputError("convergence.csv: no column " + name);
  return static_cast<std::size_t>(found - header.begin());
}

double number_in(const Cells& row, std::size_t column) {
  std::istringstream text(column < row.size() ? row[column] : "");
  double value = 0.0;
  if (!(text >> value)) throw InputError("convergence.csv: a number is missing");
  return value;
}

DesignPhase& phase_of(const std::string& stage, DesignProfile& profile) {
  for (DesignPhase& phase : profile.phases) {
    if (phase.stage == stage) return phase;
  }
  return profile.phases.emplace_back(DesignPhase{stage});
}

}  // namespace

DesignProfile design_profile(const std::string& csv, double pace) {
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  const Cells header = cells_of(line);
  const std::size_t stage = column_of(header, "stage");
  const std::size_t mae = column_of(header, "mae");
  const std::size_t seconds = column_of(header, "seconds");
  DesignProfile profile;
  while (std::getline(lines, line)) {
    const Cells row = cells_of(line);
    const double now = pace * number_in(row, seconds);
    const double error = number_in(row, mae);
    DesignPhase& phase = phase_of(row[stage], profile);
    ++phase.steps;
    phase.seconds += now - profile.seconds;
    profile.seconds = now;
    if (!(error > 0.0)) continue;
    const double least = profile.errors.empty() ? error : profile.errors.back().y();
    profile.errors.emplace_back(now, std::min(error, least));
  }
  return profile;
}

double error_after(const DesignProfile& profile, double seconds) {
  double error = std::numeric_limits<double>::quiet_NaN();
  for (const Eigen::Vector2d& point : profile.errors) {
    if (point.x() <= seconds) error = point.y();
  }
  return error;
}

}  // namespace lensforge::bench
