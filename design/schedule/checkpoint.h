// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "core/image/image.h"
#include "core/mesh/surface_mesh.h"
#include "design/schedule/convergence.h"
#include "design/schedule/guided_optimization.h"
#include "design/schedule/levels.h"
#include "design/setup/design_options.h"
#include "design/transport/semi_discrete.h"

namespace lensforge {

/// Everything that the rest of a design depends on, taken between two rounds.
struct Checkpoint {
  std::uint64_t fingerprint = 0;  ///< Of picture and options, see design_fingerprint().
  int level = 0;                  ///< Level and round to be done next.
  int round = 0;
  double value =
      std::numeric_limits<double>::infinity();  ///< Objective after the level's last round.
  bool transporting = true;  ///< The level's next round may begin with transport.
  double seconds = 0.0;      ///< Spent so far.
  SurfaceMesh mesh;          ///< A grid mesh.
  StepScales scales;         ///< Of the level's further rounds.
  std::vector<ConvergenceRow> convergence;
};

/// A number that differs for other pictures or other options that change the result.
std::uint64_t design_fingerprint(const Image& target, const DesignOptions& options);

/// Writes a checkpoint, whole or not at all. @throw RunError if it cannot be written.
void write_checkpoint(const Checkpoint& checkpoint, const std::filesystem::path& path);

/// Reads a checkpoint back, to the bit.
/// @throw InputError if the file is missing, truncated, corrupt or of another version.
Checkpoint read_checkpoint(const std::filesystem::path& path);

/// What a design tells while it runs: rows of convergence.csv, which its checkpoint keeps, and
/// progress.
class DesignLog {
 public:
  /// @param state  says which level and round is being done, and takes the rows. Both must outlive
  ///               the log.
  DesignLog(const DesignTask& task, Checkpoint& state)
      : task_(task), state_(state), spent_before_(state.seconds) {}

  /// Spent on the design so far, interruptions not counted.
  [[nodiscard]] double seconds() const;

  void add(const std::vector<TransportStep>& steps);
  /// For the iterations of a stage; it ends them when the control asks for a stop.
  [[nodiscard]] GuidedOptimization::Observer observer(const char* stage);

  /// Progress within a level. @param iteration  of the round.
  void report(const std::string& detail, int iteration) const;
  void report_rendering() const;  ///< The levels are done.
  void report_done() const;

  /// Of a step of this round, which is worth a remark to the user.
  void ended_early(const std::string& step, const std::string& why);
  /// The last such remark, to follow another; empty if there was none.
  [[nodiscard]] const std::string& remark() const { return remark_; }

 private:
  [[nodiscard]] ConvergenceRow new_row(const char* stage, int iteration) const;

  const DesignTask& task_;
  Checkpoint& state_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double spent_before_;
  std::string remark_;
};

}  // namespace lensforge
