// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fuzz/base_set.h"

namespace lensforge::fuzz {

/// Which runs, and how.
struct Campaign {
  std::uint64_t seed = 1;
  std::uint64_t first = 0;
  std::uint64_t runs = 0;
  double budget = 3.0;         ///< Seconds that a run may take before a signal asks it to stop.
  bool exec = false;           ///< Every run starts the built command.
  std::string kind;            ///< The only kind that is run; empty: all.
  std::filesystem::path kept;  ///< Folder that keeps failed runs.
};

/// Result of one run.
struct RunResult {
  std::uint64_t run = 0;
  std::string kind;
  std::string command;     ///< In shell syntax.
  std::vector<int> codes;  ///< Exit codes; minus the number of a signal.
  double seconds = 0.0;
  double stop_seconds = -1.0;
  std::vector<std::string> wrong;  ///< Rules that were broken.
};

nlohmann::json to_json(const RunResult& result);
RunResult result_of(const nlohmann::json& json);

/// Run `index`, in a new folder below `folder`. It follows from the campaign's seed and the index
/// alone.
RunResult run_one(const Campaign& campaign, const BaseSet& base, std::uint64_t index,
                  const std::filesystem::path& folder);

/// The line that repeats a run.
std::string repeat_line(const Campaign& campaign, std::uint64_t index);

}  // namespace lensforge::fuzz
