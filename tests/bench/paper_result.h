// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/paper_rows.h"

namespace lensforge::bench {

/// A row after it was run.
struct PaperResult {
  enum class Status {
    kDone,
    kNoPicture,  ///< The picture is not there.
    kRefused,    ///< `design` does not take these options or this picture (exit code 2).
    kFailed
  };

  PaperRow row;
  Status status = Status::kDone;
  std::string message = {};   ///< Reason, if not done.
  nlohmann::json lens = {};   ///< lens.json
  nlohmann::json trace = {};  ///< ray_trace's figures; null if there is no ray_trace.
  double wall_seconds = 0.0;  ///< Of the design, from its first start on.
  double cpu_seconds = 0.0;
  double peak_mib = 0.0;
  bool resumed = false;      ///< Then cpu_seconds is only of the last part.
  bool reused = false;       ///< Nothing was run.
  bool other_build = false;  ///< Made by another build of the program than the present one.

  [[nodiscard]] bool done() const { return status == Status::kDone; }
};

/// The programs that are run, and where lens folders go.
struct PaperPrograms {
  std::filesystem::path design;     ///< lensforge
  std::filesystem::path ray_trace;  ///< Need not be there.
  std::filesystem::path out;
  std::int64_t rays = 0;  ///< Per ray trace; 0: ray_trace's default.
};

/// Designs a lens and ray-traces it in child processes, or takes what an earlier call left in the
/// row's folder: a finished design of the same picture by the same options is not run again, an
/// interrupted one is resumed if the program is the same, too.
/// @throw RunError if no process can be made or a folder cannot be written.
PaperResult run_row(const PaperRow& row, const PaperPrograms& programs);

}  // namespace lensforge::bench
